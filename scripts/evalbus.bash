# Bash completion for `evalbus`. Commands, options and tasks are queried from the program.
_evalbus() {
  local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]} choices
  case $COMP_CWORD,$word in
    1,*) choices=$(evalbus --help | awk '/^  [a-z]/ { print $1 }') ;;
    *,-*) choices=$(evalbus "$command" --help 2>/dev/null | grep -oE -- '--[a-z][a-z0-9-]*' | sort -u) ;;
    *)
      case $command in
        run | watch | collect | tasks)
          choices=$(evalbus tasks list 2>/dev/null | awk 'NR > 1 && $1 ~ /^[a-z_]+$/ { print $1 }')
          ;;
      esac
      ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$word")
  [ "$COMP_CWORD" -gt 1 ] && [[ $word != -* ]] && mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -f -- "$word")
}
complete -o filenames -F _evalbus evalbus
