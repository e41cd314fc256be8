"""The actions and services of identification, on threads and a small node of their own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
import json
from math import isnan
from pathlib import Path
from threading import Event, Lock, Thread
import time
from typing import Any, TypeAlias

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, ShutdownException
from rclpy.node import Node

from servo_twin.bag import write_recording
from servo_twin.commands.terminal import new_folder
from servo_twin.description import servo_file
from servo_twin.description.home_path import at_home
from servo_twin.description.shipped import servo_at
from servo_twin.nodes.spinning import named
from servo_twin_msgs.action import Diagnose, Retrain

from ..data.stretch import ALL, instant, Stretch
from ..jobs.live.job_process import Job
from ..jobs.live.sample_ring import Ring
from ..jobs.live.servo_versions import Models
from .short_memory import is_shortage, SAID, Shortage, WAIT
from .twin_servo import LOOK_EVERY, TwinServo

Feedback: TypeAlias = Retrain.Feedback | Diagnose.Feedback
Said: TypeAlias = Mapping[str, Any]
ACTIONS = {'retrain': Retrain, 'diagnose': Diagnose}
_RUNS = 'refused: a job is running; cancel it or wait'


class Jobs(Node):
    """
    Retraining and diagnosis as actions, and the judgement of a trial.

    Actions `retrain` and `diagnose`; ``twin`` gives the twin what they make. One job at a time;
    each is a process, so that samples are never late and a cancel ends it at once.
    """

    def __init__(self, rig: Node, ring: Ring, models: Models, folder: Path,
                 shortage: Shortage) -> None:
        name, where = f'{rig.get_name()}_jobs', rig.get_namespace()
        super().__init__(name, namespace=where, cli_args=named(name, where))
        self.models, self._shortage = models, shortage
        self._ring, self._folder = ring, folder
        # what somebody asked for waits while a trial is judged, and is refused beside another
        self._asked, self._busy, self._closing = Lock(), Lock(), Event()
        self._number = 0
        group = ReentrantCallbackGroup()
        self.twin = TwinServo(self, group, models, ring, self._closing, shortage)
        shared = {'goal_callback': self._take, 'cancel_callback': lambda _: CancelResponse.ACCEPT,
                  'callback_group': group}
        # ROS remaps topics and services; an action it leaves at its name
        self._actions = [
            ActionServer(self, kind, self.resolve_service_name(name), answer, **shared)
            for (name, kind), answer in zip(ACTIONS.items(), (self._retrain, self._diagnose),
                                            strict=True)]
        self._executor = MultiThreadedExecutor(4)
        self._executor.add_node(self)
        self._thread = Thread(target=self._spin, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End jobs and threads."""
        self._closing.set()
        with self._busy:
            self._executor.shutdown(2.0)
        self._thread.join(5.0)
        if not self._thread.is_alive():
            self.destroy_node()

    def _spin(self) -> None:
        while not self._closing.is_set():
            try:
                self._executor.spin()
            except (KeyboardInterrupt, ExternalShutdownException, ShutdownException):
                return
            except Exception as problem:
                if not is_shortage(problem):
                    raise
                self._shortage.happened()
                time.sleep(WAIT)

    def _take(self, _: object) -> GoalResponse:
        if self._asked.locked():
            self.get_logger().warning(_RUNS)
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """
        Hold what a job holds alone, once no trial is judged any more.

        Raises ValueError beside another job: goals of one moment are all accepted.
        """
        if not self._asked.acquire(blocking=False):
            raise ValueError(_RUNS)
        try:
            with self._busy:
                yield
        finally:
            self._asked.release()

    # Retraining.

    def _retrain(self, handle: ServerGoalHandle) -> Retrain.Result:
        goal, result = handle.request, Retrain.Result()
        nan = float('nan')
        result.loss_before = result.loss_after = nan
        feedback = Retrain.Feedback(stage='starting', loss=nan, time_left=nan)
        try:
            if not goal.budget >= 0.0:
                raise ValueError(f'budget = {goal.budget:g} s; it must be 0, for no limit, '
                                 'or more')
            stretch = _stretch(goal)
            with self._alone():
                folder = self._next_folder('retrain')
                spec, output = folder / 'spec.json', folder / 'servo.yaml'
                spec.write_text(json.dumps({
                    'servo': str(self._running(folder)), 'learn': list(goal.learn),
                    'stretch': stretch, 'bags': self._bags(goal.bags, folder),
                    'output': str(output)}))
                with self._job('servo_identify.jobs.live.retrain_job', str(spec)) as job:
                    for said in self._reports(handle, job, feedback, goal.budget):
                        _heard(said, feedback, 'stage', 'progress', 'loss')
                        _heard(said, result, 'loss_before', 'loss_after')
                        feedback.time_left = _left(job.seconds, feedback.progress, goal.budget)
                result.servo_file = output.read_text()
                result.message = f'retrained in {job.seconds:.1f} s: {output}'
                if goal.load:
                    result.message += '; ' + self.twin.load(result.servo_file)
                result.success = True
        except (ValueError, OSError) as problem:
            result.message = str(problem)
        except (MemoryError, RuntimeError) as problem:
            result.message = self._short(problem)
        _finish(handle, result.success)
        return result

    # Diagnosis.

    def _diagnose(self, handle: ServerGoalHandle) -> Diagnose.Result:
        goal, result = handle.request, Diagnose.Result()
        try:
            stretch = _stretch(goal)
            with self._alone():
                folder = self._next_folder('diagnose')
                output = new_folder(_at(goal.output) if goal.output else folder / 'report',
                                    force=True)
                servo = servo_at(goal.servo_file) if goal.servo_file else self._running(folder)
                words = ['--stretch', *map(str, stretch), str(servo), str(output),
                         *self._bags(goal.bags, folder)]
                feedback = Diagnose.Feedback(stage='starting')
                with self._job('servo_identify.jobs.live.diagnose_job', *words) as job:
                    for said in self._reports(handle, job, feedback):
                        _heard(said, feedback, 'stage', 'progress')
                result.report = (output / 'report.json').read_text()
                self.twin.augmented = output / 'augmented.yaml'
                result.message = json.loads(result.report)['verdict']['sentence']
                result.success = True
        except (ValueError, KeyError, OSError) as problem:
            result.message = str(problem)
        except (MemoryError, RuntimeError) as problem:
            result.message = self._short(problem)
        _finish(handle, result.success)
        return result

    def judge(self, seconds: float) -> None:
        """Judge the file on trial by the last seconds, and go back when it is worse."""
        trial = self.models.trial
        if trial is None or not self._busy.acquire(blocking=False):
            return
        try:
            folder = self._next_folder('judge')
            for name, text in (('old', trial.old), ('new', trial.new)):
                (folder / f'{name}.yaml').write_text(text)
            recording = self._ring.recording(seconds, 'trial', 'trial', trial.new)
            bag = write_recording(folder / 'trial', recording)
            with self._job('servo_identify.jobs.live.compare_job', str(folder / 'old.yaml'),
                           str(folder / 'new.yaml'), str(bag)) as job:
                while job.status is None and not self._closing.is_set():
                    time.sleep(LOOK_EVERY)
                said = job.reports()
                if not said:
                    raise ValueError(job.last_words())
            if self.models.trial is not trial:
                raise ValueError('the twin runs something else by now')
            if self.models.judged(said[-1]['old'], said[-1]['new'], said[-1]['balances'],
                                  recording.duration):
                self.twin.return_to_previous(self.models.sentence)
            self.get_logger().info(self.models.sentence)
        except (ValueError, OSError) as problem:
            self.models.given_up(str(problem))
            self.get_logger().warning(self.models.sentence)
        except (MemoryError, RuntimeError) as problem:
            self.models.given_up(self._short(problem))
        finally:
            self._busy.release()

    # What jobs are given.

    @contextmanager
    def _job(self, module: str, *words: str) -> Iterator[Job]:
        job = Job(module, *words)
        try:
            yield job
        finally:
            job.kill()

    def _reports(self, handle: ServerGoalHandle, job: Job, feedback: Feedback,
                 budget: float = 0.0) -> Iterator[Said]:
        """
        Yield what a job reports until it has ended, and an empty report between two looks.

        The feedback is published at each look. Raises ValueError where the job fails or is to end.
        """
        while job.status is None:
            self._heed(handle, job, budget)
            yield from job.reports() or [{}]
            handle.publish_feedback(feedback)
            time.sleep(LOOK_EVERY)
        yield from job.reports()
        if job.status:
            raise ValueError(job.last_words())

    def _heed(self, handle: ServerGoalHandle, job: Job, budget: float) -> None:
        """Raise ValueError when a job is to end before its time."""
        if self._closing.is_set() or handle.is_cancel_requested:
            raise ValueError('cancelled; the twin goes on with the servo file that it has')
        if 0.0 < budget < job.seconds:
            raise ValueError(f'the budget of {budget:g} s is used up; the twin goes on with the '
                             f'servo file that it has')

    def _short(self, problem: Exception) -> str:
        """Return what is said of a shortage of memory; any other error goes on its way."""
        if not is_shortage(problem):
            raise problem
        self._shortage.happened()
        return SAID

    def _next_folder(self, what: str) -> Path:
        self._number += 1
        return new_folder(
            self._folder / f'{what}_{self._number}_{time.time_ns() // 10**6}', force=True)

    def _running(self, folder: Path) -> Path:
        path = folder / 'running.yaml'
        path.write_text(self.models.running)
        return path

    def _bags(self, bags: list[str], folder: Path) -> list[str]:
        """Return the bags that were named; none means those of the last minutes, one a stretch."""
        if bags:
            return [str(_at(bag)) for bag in bags]
        servo = servo_file.loads(self.models.running, 'the servo file that runs')
        return [str(write_recording(folder / one.name, one)) for one in self._ring.recordings(
            'running', servo.name, self.models.running)]


def _at(path: str) -> Path:
    """Return a path of a goal as a shell would, ~ for a home. Raises ValueError where none is."""
    if not path:
        raise ValueError("'' is no path: one of the bags is empty")
    return at_home(path)


def _stretch(goal: Diagnose.Goal | Retrain.Goal) -> Stretch:
    """Return the stretch that a goal names. Raises ValueError for what cannot be an instant."""
    given = {}
    for name, default in ALL._asdict().items():
        value = getattr(goal, name)
        try:
            given[name] = default if isnan(value) or value == 0.0 else instant(value)
        except ValueError as problem:
            raise ValueError(f'{name}: {problem}') from None
    return Stretch(**given)


def _heard(said: Said, message: Feedback | Retrain.Result, *names: str) -> None:
    """Take over the fields of a message that a job has reported."""
    for name in names:
        if name in said:
            setattr(message, name, said[name])


def _left(seconds: float, progress: float, budget: float) -> float:
    """Return how long a job may still take, s; NaN: not known."""
    by_progress = seconds * (1.0 - progress) / progress if progress > 0.05 else float('nan')
    if budget <= 0.0:
        return by_progress
    return min(budget - seconds, by_progress) if progress > 0.05 else budget - seconds


def _finish(handle: ServerGoalHandle, success: bool) -> None:
    if success:
        handle.succeed()
    elif handle.is_cancel_requested:
        handle.canceled()
    else:
        handle.abort()
