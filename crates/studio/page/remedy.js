// The buttons of a remedy: what a text tells to do with the command line, as commands of the page. Independent of the page.

/**
 * Commands of the command line that are one command of the page as well: their pattern, the button, and what is sent.
 * @type {[RegExp, string, string, object][]}
 */
const ROWS = [
  [/\bferrodrive reset (\d+)/, "Reset fault", "reset_fault", {}],
  [/\bferrodrive enable (\d+)/, "Enable", "enable", {}],
  [/\bferrodrive nmt (\d+) start/, "Start node", "nmt", { command: "start" }],
];

/** The buttons for a remedy, `{ name, command }` each, in the order of the text. */
export function buttonsOf(text) {
  const found = ROWS.flatMap(([pattern, name, word, more]) => {
    const match = pattern.exec(text);
    return match ? [{ at: match.index, name: `${name} of node ${match[1]}`, command: { do: word, node: Number(match[1]), ...more } }] : [];
  });
  return found.sort((one, other) => one.at - other.at).map(({ name, command }) => ({ name, command }));
}
