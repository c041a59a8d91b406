# The project's environment, for `. ./env.sh` in bash or zsh; ./stack uses it too. Afterwards the plain ROS commands work:
#   roslaunch pepper_bringup tele_pepper.launch nao_ip:=<robot> roscore_ip:=<this machine>

if [ -n "${BASH_VERSION:-}" ]; then _telepresence_root=${BASH_SOURCE[0]}; else _telepresence_root=${(%):-%x}; fi
_telepresence_root=$(cd "$(dirname "$_telepresence_root")" && pwd)

if [ ! -f "$_telepresence_root/catkin_ws/devel/setup.sh" ]; then
  echo "The workspace is not built yet. Run:  $_telepresence_root/stack build" >&2
  unset _telepresence_root
  return 1
fi

# catkin's setup file reads variables that may be unset.
case $- in *u*) _telepresence_nounset=1 ;; *) _telepresence_nounset= ;; esac
set +u
if [ -n "${BASH_VERSION:-}" ]; then
  . "$_telepresence_root/catkin_ws/devel/setup.bash"
else
  . "$_telepresence_root/catkin_ws/devel/setup.zsh"
fi
[ -n "$_telepresence_nounset" ] && set -u

# First in PATH: nodes with `env python3` in their first line must find the interpreter that sees rospy and the venv.
export VIRTUAL_ENV="$_telepresence_root/.venv"
case ":$PATH:" in *":$VIRTUAL_ENV/bin:"*) ;; *) export PATH="$VIRTUAL_ENV/bin:$PATH" ;; esac
# Without a name or address of its own a node announces the host name, which often nobody can resolve. A master on another
# machine calls for an address that others reach, which only a person can choose: nodes listen there, and so may strangers.
[ -n "${ROS_HOSTNAME:-}${ROS_IP:-}" ] || export ROS_IP=127.0.0.1
_telepresence_own=${ROS_HOSTNAME:-$ROS_IP}
_telepresence_master=${ROS_MASTER_URI:-http://localhost} && _telepresence_master=${_telepresence_master#*://}
_telepresence_master=${_telepresence_master%%/*}
case $_telepresence_own in
  localhost | localhost.* | ip6-localhost | 127.* | ::1)
    case $_telepresence_master in
      localhost | localhost[.:]* | ip6-localhost* | 127.* | "[::1]"* | "$(hostname)" | "$(hostname)":*) ;;
      # Perhaps another name of this machine. Who asks a name server that does not answer waits long.
      *) (cd "$_telepresence_root" && timeout --foreground 5 python3 -m telepresence.station.own_addresses "$_telepresence_master") ||
        echo "The ROS master is at ${_telepresence_master%:*}, and nodes of this shell announce $_telepresence_own: topics are listed there," \
          "and no data comes. First load the firewall rules (docs/remote.md), then: " \
          "${ROS_HOSTNAME:+unset ROS_HOSTNAME; }export ROS_IP=ADDRESS_OF_THIS_MACHINE" >&2 ;;
    esac ;;
esac
# File names and output with umlauts need UTF-8, and a locale such as C has none: Qt and tmux would write question marks.
[ "$(locale charmap 2>/dev/null)" = UTF-8 ] || export LC_ALL=C.UTF-8
# Python keeps back what it prints into a pipe or a file: whoever looks at `rosrun PACKAGE NODE | tee log` would see nothing
# for minutes.
export PYTHONUNBUFFERED=1
# Pictures are rendered and decoded in fresh 1 MB buffers; keeping them mapped halves the time to decode one.
# More than a few of them are given back.
export MALLOC_MMAP_THRESHOLD_=67108864 MALLOC_TRIM_THRESHOLD_=16777216
# Small logs: three files of 4 MB for each program, see telepresence/station/log_folder.py.
export ROS_PYTHON_LOG_CONFIG_FILE="${ROS_PYTHON_LOG_CONFIG_FILE:-$_telepresence_root/telepresence/station/python_logging.conf}"

unset _telepresence_root _telepresence_nounset _telepresence_own _telepresence_master
