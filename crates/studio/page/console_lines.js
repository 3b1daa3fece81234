// The lines of the console: which of them stop, and those that were given before. Independent of the page.

/** Lines that are remembered. */
const REMEMBERED = 100;

/** What a line stops: "all" drives, "one" of them, or null. Such a line is sent however old the page's picture is. */
export function stops(line) {
  const [first, ...more] = line.replace(/^\s*ferrodrive\s/, "").trim().split(/\s+/);
  if (first === "estop") return "all";
  if (first !== "quick-stop") return null;
  return more.includes("all") ? "all" : "one";
}

/** What was typed before: `older` and `newer` go through it from what stands in the field. */
export function history(before) {
  const lines = [...before];
  let at = lines.length;
  let begun = "";
  return {
    lines,
    /** A line was given; the same one twice counts once. */
    add(line) {
      if (lines.at(-1) !== line) lines.push(line);
      lines.splice(0, Math.max(0, lines.length - REMEMBERED));
      at = lines.length;
      begun = "";
    },
    older(typed) {
      if (at === lines.length) begun = typed;
      at = Math.max(0, at - 1);
      return lines[at] ?? typed;
    },
    newer(typed) {
      if (at === lines.length) return typed;
      at += 1;
      return lines[at] ?? begun;
    },
  };
}
