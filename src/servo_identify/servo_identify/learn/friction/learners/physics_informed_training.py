"""
A physics-informed network: a friction law that a person can read, and a small network beside it.

.. math:: \\tau_f = \\mathrm{sgn}(\\omega)\\left(\\tau_c
          + \\tau_s e^{-(\\omega/\\omega_s)^2}\\right) + b\\,\\omega + \\epsilon\\,n(\\omega, a, i)

The loss adds to the mean square error what physics forbids or dislikes: friction that drives
(:math:`\\tau_f\\,\\omega < 0`) and a network that says what the law could have said.
"""

from __future__ import annotations

import numpy as np

from ..friction_dataset import Dataset
from . import compiled_networks
from .friction_learner import Model, Told
from .network_training import scaling, train

DRIVES, SAYS = 10.0, 0.02  # weights of the two penalties


def fitted(data: Dataset, seed: int, seconds: float, told: Told | None) -> Model:
    """Fit law and network together."""
    import torch
    from torch import nn

    torch.manual_seed(seed)
    torch.use_deterministic_algorithms(True)
    centre, span, _, size = scaling(data)
    top = float(np.max(np.abs(data.features[data.train, 0])))

    class Informed(nn.Module):
        """Law and rest, in units of the target's deviation; speed in units of the top speed."""

        def __init__(self):
            super().__init__()
            self.law = nn.Parameter(torch.tensor([0.5, 0.1, 0.3, 0.05]))
            self.rest = nn.Sequential(nn.Linear(3, 32), nn.Tanh(), nn.Linear(32, 32), nn.Tanh(),
                                      nn.Linear(32, 1))

        def forward(self, x):
            speed = x[:, 0] * float(span[0]) / top + float(centre[0]) / top
            p = torch.abs(self.law)
            fade = torch.exp(-((speed / (p[3] + 1e-3)) ** 2))
            self.beside = self.rest(x)[:, 0]
            self.speed = speed
            return torch.sign(speed) * (p[0] + p[1] * fade) + p[2] * speed + self.beside

    def loss(net, x, y):
        found = net(x)
        drives = torch.relu(-found * net.speed)
        return (torch.mean((found - y) ** 2) + DRIVES * torch.mean(drives**2)
                + SAYS * torch.mean(net.beside**2))

    def ready(rows: np.ndarray):
        return torch.tensor((data.features[rows] - centre) / span, dtype=torch.float32)

    def target(rows: np.ndarray):
        return torch.tensor(data.target[rows] / size, dtype=torch.float32)

    net = Informed()
    inputs = (ready(data.train), target(data.train), ready(data.validation),
              target(data.validation))
    train(net, loss, inputs, data, seconds, told, rate=3e-3)

    def predict(other: Dataset, rows: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return net(ready(rows)).numpy().astype(float) * size

    p = np.abs(net.law.detach().numpy().astype(float)) * size
    fade = (abs(float(net.law[3].detach())) + 1e-3) * top
    w = {k: v.detach().numpy().astype(float) for k, v in net.state_dict().items()}
    arrays = tuple(w[f'rest.{i}.{n}'] for i in (0, 2, 4) for n in ('weight', 'bias'))
    x = (data.features[data.test[0]] - centre) / span
    return Model('physics_informed', predict, sum(q.numel() for q in net.parameters()),
                 lambda: compiled_networks.dense(x, *arrays),
                 f'sgn(w) ({p[0]:.4g} + {p[1]:.4g} exp(-(w/{fade:.3g})^2)) + {p[2] / top:.4g} w '
                 '+ a small network')


LEARNERS = {'physics_informed': fitted}
