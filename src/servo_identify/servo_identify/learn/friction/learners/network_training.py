"""
The networks of paper 003: feedforward, CNN, LSTM and transformer.

Trained with Adam on the mean square error, features and target scaled to unit variance, early
stopping on the validation part (section 3.6, table 1). torch is imported here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Callable
import time

import numpy as np

from ..friction_dataset import Dataset, SEQUENCE
from . import compiled_networks
from .friction_learner import Model, Told

EPOCHS, PATIENCE, RATE, HIDDEN, HEADS = 150, 12, 1e-3, 64, 2
BATCH = 256  # paper: 64; four times as many rows a step train to the same loss in a third


def scaling(data: Dataset) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Return mean and deviation of features and target over the training rows."""
    x, y = data.features[data.train], data.target[data.train]
    return (x.mean(axis=0), np.maximum(x.std(axis=0), 1e-12), float(y.mean()),
            max(float(y.std()), 1e-12))


def train(net, loss_of: Callable, inputs: tuple, data: Dataset, seconds: float,
          told: Told | None, rate: float = RATE) -> None:
    """
    Train in place; keep the weights that predict the validation rows best.

    ``inputs`` are (train x, train y, validation x, validation y); ``loss_of(net, x, y)`` is what
    is minimised. Ends after EPOCHS, ``seconds`` of processor time or PATIENCE epochs without gain.
    """
    import torch

    torch.set_num_threads(1)  # the layers are small, and threads on busy cores wait for each other
    x, y, vx, vy = inputs
    optimiser = torch.optim.Adam(net.parameters(), lr=rate)
    begun, best, kept, since = time.thread_time(), np.inf, None, 0
    for epoch in range(EPOCHS):
        net.train()
        total = 0.0
        for rows in torch.randperm(len(x)).split(BATCH):
            optimiser.zero_grad()
            loss = loss_of(net, x[rows], y[rows])
            loss.backward()
            optimiser.step()
            total += loss.item() * len(rows)
        net.eval()
        with torch.no_grad():
            held = float(np.mean((np.concatenate([net(p).numpy() for p in vx.split(4096)])
                                  - vy.numpy()) ** 2))
        if told:
            told(epoch, total / len(x), held)
        if held < best * (1.0 - 1e-3):
            best, since = held, 0
            kept = {k: v.clone() for k, v in net.state_dict().items()}
        else:
            since += 1
        if since >= PATIENCE or time.thread_time() - begun > seconds:
            break
    net.load_state_dict(kept)


def _network(kind: str):
    import torch
    from torch import nn

    class Last(nn.Module):
        """The last sample of the window."""

        def forward(self, x):
            return x[:, -1]

    class Lstm(nn.Module):

        def __init__(self):
            super().__init__()
            self.cell, self.out = nn.LSTM(3, HIDDEN, batch_first=True), nn.Linear(HIDDEN, 1)

        def forward(self, x):
            return self.out(self.cell(x)[0][:, -1])[:, 0]

    class Transformer(nn.Module):

        def __init__(self):
            super().__init__()
            self.enter = nn.Linear(3, 32)
            self.at = nn.Parameter(0.02 * torch.randn(SEQUENCE, 32))
            self.layer = nn.TransformerEncoderLayer(32, HEADS, 64, dropout=0.0, batch_first=True)
            self.out = nn.Linear(32, 1)

        def forward(self, x):
            return self.out(self.layer(self.enter(x) + self.at)[:, -1])[:, 0]

    class Convolution(nn.Module):

        def __init__(self):
            super().__init__()
            self.one, self.two = nn.Conv1d(3, 32, 5), nn.Conv1d(32, 32, 5)
            self.out = nn.Linear(32, 1)

        def forward(self, x):
            inner = torch.relu(self.two(torch.relu(self.one(x.transpose(1, 2)))))
            return self.out(inner.mean(dim=2))[:, 0]

    if kind == 'feedforward':
        return nn.Sequential(Last(), nn.Linear(3, HIDDEN), nn.Tanh(), nn.Linear(HIDDEN, HIDDEN),
                             nn.Tanh(), nn.Linear(HIDDEN, 1), nn.Flatten(0))
    return {'cnn': Convolution, 'lstm': Lstm, 'transformer': Transformer}[kind]()


def _exported(kind: str, net) -> Callable[[np.ndarray], float]:
    """Return the network compiled from plain arrays, of one scaled window (SEQUENCE, 3)."""
    w = {k: v.detach().numpy().astype(float) for k, v in net.state_dict().items()}
    if kind == 'feedforward':
        arrays = tuple(w[f'{i}.{p}'] for i in (1, 3, 5) for p in ('weight', 'bias'))
        return lambda x: compiled_networks.dense(x[-1], *arrays)
    if kind == 'cnn':
        arrays = tuple(w[f'{n}.{p}'] for n in ('one', 'two', 'out') for p in ('weight', 'bias'))
        return lambda x: compiled_networks.convolution(x, *arrays)
    if kind == 'lstm':
        arrays = (w['cell.weight_ih_l0'], w['cell.weight_hh_l0'],
                  w['cell.bias_ih_l0'] + w['cell.bias_hh_l0'], w['out.weight'], w['out.bias'])
        return lambda x: compiled_networks.recurrent(x, *arrays)
    inner = ('self_attn.in_proj_weight', 'self_attn.in_proj_bias', 'self_attn.out_proj.weight',
             'self_attn.out_proj.bias', 'norm1.weight', 'norm1.bias', 'linear1.weight',
             'linear1.bias', 'linear2.weight', 'linear2.bias', 'norm2.weight', 'norm2.bias')
    arrays = (w['enter.weight'], w['enter.bias'], w['at'], *(w[f'layer.{n}'] for n in inner),
              w['out.weight'], w['out.bias'])
    return lambda x: compiled_networks.attention(x, *arrays, HEADS)


def _learner(kind: str):
    def fitted(data: Dataset, seed: int, seconds: float, told: Told | None) -> Model:
        import torch

        torch.manual_seed(seed)
        torch.use_deterministic_algorithms(True)
        centre, span, middle, size = scaling(data)

        def ready(rows: np.ndarray):
            return torch.tensor((data.windows(rows) - centre) / span, dtype=torch.float32)

        def target(rows: np.ndarray):
            return torch.tensor((data.target[rows] - middle) / size, dtype=torch.float32)

        net = _network(kind)
        inputs = (ready(data.train), target(data.train), ready(data.validation),
                  target(data.validation))
        train(net, lambda n, x, y: torch.mean((n(x) - y) ** 2), inputs, data, seconds, told)

        def predict(other: Dataset, rows: np.ndarray) -> np.ndarray:
            with torch.no_grad():
                parts = [net(p).numpy() for p in ready(rows).split(4096)]
            return np.concatenate(parts).astype(float) * size + middle if parts else np.array([])

        alone = _exported(kind, net)
        window = (data.windows(data.test[:1])[0] - centre) / span
        return Model(kind, predict, sum(p.numel() for p in net.parameters()),
                     lambda: alone(window) * size + middle)

    return fitted


LEARNERS = {kind: _learner(kind) for kind in ('feedforward', 'cnn', 'lstm', 'transformer')}
