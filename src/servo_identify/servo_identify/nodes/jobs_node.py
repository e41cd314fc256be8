"""The actions and services of identification, on threads and a small node of their own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import json
from pathlib import Path
from threading import Event, Lock, Thread
import time

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, ShutdownException
from rclpy.node import Node
from std_srvs.srv import Trigger

from servo_twin.bag import write_recording
from servo_twin.commands.terminal import new_folder
from servo_twin.description import servo_file
from servo_twin.description.home_path import at_home
from servo_twin.description.shipped import servo_at
from servo_twin.nodes.spinning import named
from servo_twin_msgs.action import Diagnose, Retrain
from servo_twin_msgs.srv import LoadServo

from ..jobs.live.job_process import Job
from ..jobs.live.sample_ring import Ring
from ..jobs.live.servo_versions import Models
from .short_memory import is_shortage, SAID, Shortage, WAIT

SERVICES = {'twin/load_servo': LoadServo, 'identify/go_back': Trigger,
            'identify/load_augmented': Trigger}
LOOK_EVERY = 0.1  # s between two looks at a job
_LOADING = 60.0  # s that the twin may take to compile and load
_RUNS = 'refused: a job is running; cancel it or wait'


class Jobs(Node):
    """
    Retraining and diagnosis as actions, and the judgement of a trial.

    Actions `retrain` and `diagnose`, services `identify/go_back` and `identify/load_augmented`.
    One job at a time; each is a process, so that samples are never late and a cancel ends it at
    once.
    """

    def __init__(self, rig: Node, ring: Ring, models: Models, folder: Path,
                 shortage: Shortage) -> None:
        name, where = f'{rig.get_name()}_jobs', rig.get_namespace()
        super().__init__(name, namespace=where, cli_args=named(name, where))
        self.models, self._shortage = models, shortage
        self._ring, self._folder = ring, folder
        # what somebody asked for waits while a trial is judged, and is refused beside another
        self._asked, self._busy, self._closing = Lock(), Lock(), Event()
        self._loads = Lock()
        self._number = 0
        self._augmented: Path | None = None
        group = ReentrantCallbackGroup()
        self._twin = self.create_client(LoadServo, 'twin/load_servo', callback_group=group)
        self.create_service(Trigger, 'identify/go_back', shortage.guarded(self._go_back),
                            callback_group=group)
        self.create_service(Trigger, 'identify/load_augmented',
                            shortage.guarded(self._load_augmented), callback_group=group)
        shared = {'goal_callback': self._take, 'cancel_callback': lambda _: CancelResponse.ACCEPT,
                  'callback_group': group}
        self._actions = [
            ActionServer(self, Retrain, 'retrain', self._retrain, **shared),
            ActionServer(self, Diagnose, 'diagnose', self._diagnose, **shared)]
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
            with self._alone():
                folder = self._next_folder('retrain')
                spec, output = folder / 'spec.json', folder / 'servo.yaml'
                spec.write_text(json.dumps({
                    'servo': str(self._running(folder)), 'learn': list(goal.learn),
                    'bags': self._bags(goal.bags, folder), 'output': str(output)}))
                with self._job('servo_identify.jobs.live.retrain_job', str(spec)) as job:
                    while job.status is None:
                        self._heed(handle, job, goal.budget)
                        for said in job.reports():
                            feedback.stage = said.get('stage', feedback.stage)
                            feedback.progress = said.get('progress', feedback.progress)
                            feedback.loss = said.get('loss', feedback.loss)
                            result.loss_before = said.get('loss_before', result.loss_before)
                            result.loss_after = said.get('loss_after', result.loss_after)
                        feedback.time_left = _left(job.seconds, feedback.progress, goal.budget)
                        handle.publish_feedback(feedback)
                        time.sleep(LOOK_EVERY)
                    for said in job.reports():
                        result.loss_before = said.get('loss_before', result.loss_before)
                        result.loss_after = said.get('loss_after', result.loss_after)
                    if job.status:
                        raise ValueError(job.last_words())
                result.servo_file = output.read_text()
                result.message = f'retrained in {job.seconds:.1f} s: {output}'
                if goal.load:
                    result.message += '; ' + self.load(result.servo_file)
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
            with self._alone():
                folder = self._next_folder('diagnose')
                output = new_folder(_at(goal.output) if goal.output else folder / 'report',
                                    force=True)
                servo = servo_at(goal.servo_file) if goal.servo_file else self._running(folder)
                words = [str(servo), str(output), *self._bags(goal.bags, folder)]
                feedback = Diagnose.Feedback(stage='starting')
                with self._job('servo_identify.jobs.live.diagnose_job', *words) as job:
                    while job.status is None:
                        self._heed(handle, job, 0.0)
                        for said in job.reports():
                            feedback.stage = said.get('stage', feedback.stage)
                            feedback.progress = said.get('progress', feedback.progress)
                        handle.publish_feedback(feedback)
                        time.sleep(LOOK_EVERY)
                    if job.status:
                        raise ValueError(job.last_words())
                result.report = (output / 'report.json').read_text()
                self._augmented = output / 'augmented.yaml'
                result.message = json.loads(result.report)['verdict']['sentence']
                result.success = True
        except (ValueError, KeyError, OSError) as problem:
            result.message = str(problem)
        except (MemoryError, RuntimeError) as problem:
            result.message = self._short(problem)
        _finish(handle, result.success)
        return result

    # The twin's servo file.

    def load(self, text: str) -> str:
        """Have the twin run a servo file; raises ValueError with what it says against it."""
        with self._giving():
            answer = self._ask(text)
            self.models.loaded(text, answer.previous, self._ring.next)
        return answer.message

    def return_to_previous(self, why: str) -> str:
        """Have the twin run the file before; raises ValueError when it does not."""
        with self._giving():
            if not self.models.previous:
                raise ValueError('there is no servo file to go back to: none was loaded from here')
            back = self.models.previous
            answer = self._ask(back)
            self.models.returned(back, answer.previous, why)
        return answer.message

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
                self.return_to_previous(self.models.sentence)
            self.get_logger().info(self.models.sentence)
        except (ValueError, OSError) as problem:
            self.models.given_up(str(problem))
            self.get_logger().warning(self.models.sentence)
        except (MemoryError, RuntimeError) as problem:
            self.models.given_up(self._short(problem))
        finally:
            self._busy.release()

    @contextmanager
    def _giving(self) -> Iterator[None]:
        """
        Give the twin one file at a time; raises ValueError while another one is on its way.

        Who waited would take the threads away by which the twin's answer comes.
        """
        if not self._loads.acquire(blocking=False):
            raise ValueError('refused: the twin is just being given a servo file; wait for that')
        try:
            yield
        finally:
            self._loads.release()

    def _ask(self, text: str) -> LoadServo.Response:
        if not self._twin.wait_for_service(5.0):
            raise ValueError('no twin runs here: its service twin/load_servo is not there')
        answered = Event()
        self.models.asks(text)
        future = self._twin.call_async(LoadServo.Request(content=text))
        future.add_done_callback(lambda _: answered.set())
        until = time.monotonic() + _LOADING
        while not (answered.wait(LOOK_EVERY) or self._closing.is_set()
                   or time.monotonic() > until):
            pass
        if answered.is_set() and future.result().success:
            return future.result()
        self.models.asks('')
        if not answered.is_set():
            raise ValueError('this node ends, and the twin has not answered yet'
                             if self._closing.is_set() else
                             f'the twin did not answer within {_LOADING:g} s')
        raise ValueError(f'the twin refused the servo file: {future.result().message}')

    def _go_back(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            response.message = self.return_to_previous('it was asked for')
            response.success = True
        except ValueError as problem:
            response.message = str(problem)
        return response

    def _load_augmented(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            if self._augmented is None:
                raise ValueError('there is no augmented servo file: nothing was diagnosed yet')
            response.message = self.load(self._augmented.read_text())
            response.success = True
        except (ValueError, OSError) as problem:
            response.message = str(problem)
        return response

    # What jobs are given.

    @contextmanager
    def _job(self, module: str, *words: str) -> Iterator[Job]:
        job = Job(module, *words)
        try:
            yield job
        finally:
            job.kill()

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
