# Completion of `afterglow`: verbs, their options as --help has them, behaviors by name and id; else files. Bash finds it
# where it is installed; zsh (5 or newer) reads it by
#   autoload -U +X bashcompinit compinit && compinit && bashcompinit && source .../bash-completion/completions/afterglow
_afterglow_help() {  # the first words of the indented lines of --help that match
  "${COMP_WORDS[0]}" "${@:2}" --help 2>/dev/null | grep -oE "$1" | tr -d ' ,'
}

_afterglow_behaviors() {  # names and ids, in the store that the line names
  local store=() i
  for ((i = 1; i < COMP_CWORD; i++)); do
    [ "${COMP_WORDS[i]}" = --store ] && store=(--store "${COMP_WORDS[i + 1]}")
  done
  "${COMP_WORDS[0]}" list --json --limit 200 "${store[@]}" 2>/dev/null |
    sed -nE 's/^    "name": "([A-Za-z0-9_.\/-]+)",?$/\1/p; s/^    "id": ([0-9]+),?$/\1/p' | sort -u
}

_afterglow() {
  local word=${COMP_WORDS[COMP_CWORD]} verb=(${COMP_WORDS[1]:+"${COMP_WORDS[1]}"}) words=
  if [ "$COMP_CWORD" = 1 ]; then
    words=$(_afterglow_help '^  [a-z]+ ')
  elif [[ $word == -* ]]; then
    [[ ${verb[0]} =~ ^(calibrate|store)$ ]] && verb+=("${COMP_WORDS[2]}")
    words=$(_afterglow_help '(^  |,)-{1,2}[a-z][a-z-]*' "${verb[@]}")
  elif [[ ${verb[0]} =~ ^(calibrate|store)$ ]]; then
    [ "$COMP_CWORD" = 2 ] && words=$(_afterglow_help '^  [a-z]+ ' "${verb[0]}")
  elif [[ ${verb[0]} =~ ^(show|info|play|export|render|edit)$ ]]; then
    words=$(_afterglow_behaviors)
  fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}
complete -o bashdefault -o default -F _afterglow afterglow
