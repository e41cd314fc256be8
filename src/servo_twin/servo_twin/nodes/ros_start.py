"""
How a node starts ROS: by UDP alone, also where it looks for others on this machine only.

A process that is killed while it makes shared memory of Fast DDS leaves it half made, and whoever
opens that waits without end. `FASTDDS_BUILTIN_TRANSPORTS=UDPv4` has Fast DDS make none, but
rmw_fastrtps makes some of its own for `ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST`. The profile
config/dds/this_host.xml sets what it sets for that range, without shared memory.
"""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
import sys

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError
import rclpy
from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

TRANSPORTS, UDP = 'FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4'
RANGE, ONLY, PEERS = 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS'
PROFILES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
"""The name that Fast DDS 2 reads, and that of Fast DDS 3."""


def start_ros(arguments: list[str] | None = None) -> None:
    """
    Start ROS without its signal handlers and, unless it is asked for, without shared memory.

    Arguments that ROS cannot read, such as a parameter file that is no YAML, end the process with
    status 2 and a sentence.

    A parameter that is set to a value of a type that ROS does not have is refused as one without a
    value: rclpy raises ValueError out of the executor, which ends the process.
    """
    os.environ.update(udp_alone(os.environ))
    Parameter.Type._missing_ = lambda _: Parameter.Type.NOT_SET
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except (RCLError, UnknownROSArgsError) as error:
        said = str(error).removeprefix('failed to initialize rcl: ').partition(', at /')[0]
        if isinstance(error, UnknownROSArgsError):
            said = f'behind --ros-args, ROS knows no {said}'
        elif 'log directory' in said:
            said += '; the environment variable ROS_LOG_DIR names another place'
        print(f'{Path(sys.argv[0]).stem}: {said}', file=sys.stderr)
        raise SystemExit(2) from None


def udp_alone(given: Mapping[str, str]) -> dict[str, str]:
    """
    Return the environment variables by which Fast DDS makes no shared memory.

    What was ``given`` rules: another value of FASTDDS_BUILTIN_TRANSPORTS, a profile of the user's
    own, or peers on other machines beside LOCALHOST leave the discovery as it is.
    """
    told = {TRANSPORTS: given.get(TRANSPORTS) or UDP}
    file = _profile()
    if (told[TRANSPORTS] != UDP or given.get(PEERS) or any(given.get(name) for name in PROFILES)
            or not (given.get(ONLY) == '1' or given.get(RANGE) == 'LOCALHOST')
            or not file.is_file()
            or not rclpy.get_rmw_implementation_identifier().startswith('rmw_fastrtps')):
        return told
    return told | {RANGE: 'SYSTEM_DEFAULT', ONLY: ''} | dict.fromkeys(PROFILES, str(file))


def _profile() -> Path:
    """Return where the profile is installed; there need be none."""
    try:
        share = Path(get_package_share_directory('servo_twin'))
    except PackageNotFoundError:
        share = Path()
    return share / 'config' / 'dds' / 'this_host.xml'
