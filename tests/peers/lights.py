"""Flash codes, read as an eye reads them: by the world's outputs, again and again."""

import time


def flashes(bench, led, for_s):
    """The lengths of what the light was on for, in simulated seconds, and of the darkness after each."""
    end = bench.now() + for_s
    changes = []
    while (get := bench.world("get"))["t"] < end:
        on = get["outputs"][led]
        if not changes or changes[-1][1] != on:
            changes.append((get["t"], on))
        time.sleep(0.01)
    lengths = [(on, later - at) for (at, on), (later, _) in zip(changes, changes[1:])]
    return lengths[1:]


def bursts(lengths):
    """Flashes between long darknesses, as L for long and s for short."""
    lit = [length for on, length in lengths if on]
    dark = [length for on, length in lengths if not on]
    if not lit or not dark:
        return []
    pause, long = max(dark) * 0.7, max(lit) * 0.6
    words, word = [], ""
    for on, length in lengths:
        if on:
            word += "L" if length > long else "s"
        elif length > pause:
            words.append(word)
            word = ""
    return words[1:]


def usual(words):
    """The word seen most often: a busy machine may look away for a moment."""
    return max(set(words), key=words.count, default=None)
