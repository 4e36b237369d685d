"""The answers of the node to Fast DDS on another computer: a network of Ethernet's packets, and a tunnel of smaller ones.

A slow proof: a shard of tests/shards.sh runs it; without that it is not collected (conftest.py).
"""

from functools import partial

import pytest
from ros_domains import domains
from ros_echo import Echo
from ros_network import Hub
from test_ros_fastdds import (
    a_long_text_is_cut_and_reported,
    fast_dds,  # noqa: F401
    features_are_on_the_topic,
    parameters_are_listed_dumped_and_described,
    the_result_of_a_goal_comes,
    what_was_probed_is_on_topics,
)

ETHERNET, TUNNEL = 1500, 1280


@pytest.mark.parametrize("packet", [ETHERNET, TUNNEL])
def test_the_largest_answers_reach_another_computer(fast_dds, packet):  # noqa: F811
    domain = next(domains)
    with Hub(["node", "caller"], 0, packet=packet) as hub:
        caller = hub.wrapper("caller")
        # a node for each, so that its log has each answer that does not fit
        for proof in [
            partial(parameters_are_listed_dumped_and_described, packet=packet),
            features_are_on_the_topic,
            what_was_probed_is_on_topics,
            the_result_of_a_goal_comes,
            a_long_text_is_cut_and_reported,
        ]:
            with Echo(domain, wrapper=hub.wrapper("node")) as echo:
                proof(fast_dds, echo, domain, caller)
    assert hub.passed > 0 and hub.dropped == 0
    # each answer is one packet, except the descriptions of all parameters in a tunnel: 1124 bytes, with room for 1088
    assert (hub.parted["node"] > 0) == (packet == TUNNEL)
