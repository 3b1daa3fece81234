# Completion of `ferrodrive` in bash. The program itself says what the line may go on with.
_ferrodrive() {
    # Bash splits a line at each of COMP_WORDBREAKS, so that `socketcand://HOST:29536/can0` comes in five words. Those that no blank
    # parts are one word of the line; the last of them ends at the cursor.
    local line=${COMP_LINE:0:COMP_POINT} words=() before word
    for word in "${COMP_WORDS[@]:0:COMP_CWORD}"; do
        before=${line%%"$word"*}
        if [[ ${#words[@]} -eq 0 || -n $before ]]; then
            words+=("$word")
        else
            words[${#words[@]} - 1]+=$word
        fi
        line=${line:${#before}+${#word}}
    done
    local current=${line#"${line%%[![:space:]]*}"}
    if [[ $line == "$current" && ${#words[@]} -gt 1 ]]; then
        current=${words[${#words[@]} - 1]}$line
        unset "words[${#words[@]} - 1]"
    fi
    words+=("$current")
    # As they are meant: without the quotes around them.
    words=("${words[@]#[\"\']}")
    words=("${words[@]%[\"\']}")

    local IFS=$'\v'
    COMPREPLY=($(_CLAP_IFS="$IFS" _CLAP_COMPLETE_INDEX=$((${#words[@]} - 1)) _CLAP_COMPLETE_COMP_TYPE="$COMP_TYPE" \
        _CLAP_COMPLETE_SPACE=false FERRODRIVE_COMPLETE=bash ferrodrive -- "${words[@]}" 2> /dev/null))
    # Bash puts an answer in the place of $2, which is what stands behind the last split.
    COMPREPLY=("${COMPREPLY[@]#"${current%"$2"}"}")
    if [[ ${#COMPREPLY[@]} -ne 1 || ${COMPREPLY[0]} != *[=/:] ]]; then
        compopt +o nospace 2> /dev/null
    fi
}
complete -o nospace -o bashdefault -o nosort -F _ferrodrive ferrodrive 2> /dev/null ||
    complete -o nospace -o bashdefault -F _ferrodrive ferrodrive
