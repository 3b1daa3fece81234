// What a key means, wherever the focus is. Keys of one character can be switched off (WCAG 2.2, 2.1.4): a word that is spoken to a
// computer, or a hand that slips, then does nothing. Escape and Space stop whatever is set. No knowledge of the page.

/** Keys of one character, other than Space. */
const isCharacter = (key) => [...key].length === 1 && key !== " ";

/**
 * "stop", "help", "view" (the number of one), "own" (up to the view that is shown) or "none". `in_text` is a field in which Space is
 * a space, `types` any element that takes keys itself, `characters` whether keys of one character do something.
 */
export function meaningOf({ key, ctrlKey = false, altKey = false, metaKey = false }, { in_text, types, characters }) {
  if (key === "Escape" || (key === " " && !in_text)) return "stop";
  if (types || ctrlKey || altKey || metaKey) return "none";
  if (isCharacter(key) && !characters) return "none";
  if (key === "?") return "help";
  return /^[1-9]$/.test(key) ? "view" : "own";
}
