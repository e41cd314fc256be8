"""A lifecycle node that outlives requests that do not fit its state; the twin has its own."""

from __future__ import annotations

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn


class ManagedNode(LifecycleNode):
    """
    Says what broke in a transition, which rclpy keeps to itself.

    Answers a transition that does not fit the state with FAILURE, and says which would fit.

    rclpy does so for a transition asked for by its label. For one asked for by its id alone it
    raises RCLError out of the executor, which ends the process and leaves the motor to its drive.
    """

    def _LifecycleNodeMixin__change_state(self, transition_id: int) -> TransitionCallbackReturn:
        fitting = {one[0]: one[1] for one in self._state_machine.available_transitions}
        if transition_id in fitting:
            return super()._LifecycleNodeMixin__change_state(transition_id)
        self.get_logger().warning(
            f'transition {transition_id} does not fit the state '
            f'{self._state_machine.current_state[1]!r}; there are {fitting}')
        return TransitionCallbackReturn.FAILURE

    def _LifecycleNodeMixin__execute_callback(self, state_id: int, previous: LifecycleState
                                              ) -> TransitionCallbackReturn:
        callback = self._callbacks.get(state_id, lambda _: TransitionCallbackReturn.SUCCESS)
        try:
            return callback(previous)
        except Exception as error:
            self.get_logger().error(f'{callback.__name__} broke: {type(error).__name__}: {error}')
            return TransitionCallbackReturn.ERROR
