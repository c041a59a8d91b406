# The shell in the window's terminal: the project's environment, a short prompt, no history in the pilot's own file.
if [ -z "${ROS_PACKAGE_PATH:-}" ]; then . "$(dirname "${BASH_SOURCE[0]}")/../../env.sh"; fi
unset HISTFILE
PS1='\[\e[38;5;74m\]\W\[\e[0m\] $ '
alias ls='ls --color=auto' grep='grep --color=auto'
