# Puts the workspace into the calling shell: `. ./env.sh`, from any folder (in plain sh: from here).
# Afterwards servo-twin, servo-identify, driver, recorder, emulated_rig and can_hub are commands.

if [ -n "${BASH_SOURCE:-}" ]; then
  _servo_root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
elif [ -n "${ZSH_VERSION:-}" ]; then
  _servo_root=$(cd "$(dirname "$(eval 'printf %s "${(%):-%x}"')")" && pwd)
else
  _servo_root=$PWD
fi

# Puts $2 in front of the colon-separated variable named $1, unless it is there already.
_servo_prepend() {
  eval "_servo_value=\${$1:-}"
  case ":$_servo_value:" in
    *":$2:"*) ;;
    *) eval "export $1=\"\$2\${_servo_value:+:\$_servo_value}\"" ;;
  esac
}

# Prints the folders that the ROS 2 wheels keep their shared libraries in, with colons between.
_servo_wheel_libraries() {
  printf %s "$_servo_root/.venv/lib"
  find "$_servo_root/.venv/$_servo_packages" -maxdepth 1 -name 'ros_*.libs' -exec printf ':%s' {} +
}

_servo_activate() {
  if [ ! -f "$_servo_root/.venv/workspace.stamp" ]; then
    echo "env.sh: $_servo_root is not set up yet; run 'make setup' there first." >&2
    return 1
  fi
  _servo_packages=$("$_servo_root/.venv/bin/python" -c \
    'import sys; print("lib/python%d.%d/site-packages" % sys.version_info[:2])') || return 1
  unset PYTHONHOME
  export VIRTUAL_ENV="$_servo_root/.venv"
  _servo_prepend PATH "$_servo_root/.venv/bin"
  # Inside a sourced ROS 2 there are no wheels, and ROS's own paths stay behind ours.
  if [ -d "$_servo_root/.venv/share/ament_index" ]; then
    _servo_prepend AMENT_PREFIX_PATH "$_servo_root/.venv"
    _servo_prepend LD_LIBRARY_PATH "$(_servo_wheel_libraries)"
    # The wheels would start every Python twice, to set LD_LIBRARY_PATH in an order by chance.
    export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
  fi
  # A process that is killed while it makes shared memory of Fast DDS leaves it half made, and
  # whoever opens it waits without end (docs/soak.md). ROS ignores it for discovery on this machine
  # alone; our nodes see to that themselves (ros_start.py).
  export FASTDDS_BUILTIN_TRANSPORTS="${FASTDDS_BUILTIN_TRANSPORTS:-UDPv4}"
  _servo_prepend AMENT_PREFIX_PATH "$_servo_root/install"
  _servo_prepend LD_LIBRARY_PATH "$_servo_root/install/lib"
  _servo_prepend PYTHONPATH "$_servo_root/install/$_servo_packages"
  for _servo_package in servo_rig_driver servo_twin servo_identify servo_studies; do
    _servo_prepend PYTHONPATH "$_servo_root/build/$_servo_package"
    _servo_prepend PATH "$_servo_root/install/lib/$_servo_package"
  done
}

_servo_activate
_servo_status=$?
unset -f _servo_prepend _servo_wheel_libraries _servo_activate
unset _servo_root _servo_value _servo_packages _servo_package
# The status of this line is the status of sourcing the file.
eval "unset _servo_status; [ $_servo_status -eq 0 ]"
