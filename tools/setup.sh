#!/bin/sh
# Finds a Python that runs and lets it set the workspace up. PYTHON=... names one.
root=$(cd "$(dirname "$0")/.." && pwd)
suits='import sys; assert sys.version_info[:2] in ((3, 11), (3, 12))'

if [ -n "${PYTHON:-}" ]; then
  candidates=$PYTHON
else
  candidates="$root/.venv/bin/python python3.12 python3.11 python3"
fi
if [ -n "${ROS_DISTRO:-}" ]; then
  # A sourced ROS 2 is imported from its own folders, which only its own Python can do.
  suits="$suits; import rclpy"
  candidates=${PYTHON:-python3 python3.12 python3.11}
fi
for candidate in $candidates; do
  # A name on the PATH may be a shim that runs nothing, so it has to prove itself.
  if "$candidate" -c "$suits" >/dev/null 2>&1; then
    exec "$candidate" "$root/tools/setup_workspace.py" "$@"
  fi
done
if [ -n "${ROS_DISTRO:-}" ]; then
  echo "set-up: ROS 2 $ROS_DISTRO is sourced, and none of $candidates imports its rclpy." >&2
elif [ -n "${PYTHON:-}" ]; then
  echo "set-up: PYTHON=$PYTHON is no Python 3.11 or 3.12 that runs." >&2
else
  echo "set-up: no Python 3.11 or 3.12 runs here (tried python3.12, python3.11, python3);" \
    "on Debian or Ubuntu: apt install python3 python3-venv python3-dev." >&2
fi
exit 1
