"""A node under test is asked when it knows the way back to who asks: else its answer is lost."""

from time import monotonic

from rcl_interfaces.srv import GetParameters

AGAIN = 1.0  # s after which a question without an answer is asked again


def knows_the_way_back(node, other, wait):
    """
    Wait until another node has heard of every client that this one has made.

    A service may be seen before it has seen its client, and then answers nobody. What a node
    makes is announced in order, so one answer is enough. ``wait`` runs callbacks until a
    condition holds.
    """
    client = node.create_client(GetParameters, f'{other}/get_parameters')
    asked = []

    def answers():
        if client.service_is_ready() and (not asked or monotonic() - asked[-1][0] > AGAIN):
            asked.append((monotonic(), client.call_async(GetParameters.Request())))
        return any(future.done() for _, future in asked)

    wait(answers)
    node.destroy_client(client)
