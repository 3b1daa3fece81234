// What a key does, wherever the focus is. Single-character keys can be switched off (WCAG 2.2, 2.1.4): speech input,
// or a hand that slips, then does nothing. Escape and Space always stop. Independent of the page.

/** Single-character keys other than Space. */
const isCharacter = (key) => [...key].length === 1 && key !== " ";

/**
 * "stop", "help", "view" (the number of a view), "own" (left to the view that is shown) or "none". `in_text`: a field in which Space is
 * a space; `types`: any element that takes keys itself; `characters`: whether single-character keys are on.
 */
export function meaningOf({ key, ctrlKey = false, altKey = false, metaKey = false }, { in_text, types, characters }) {
  if (key === "Escape" || (key === " " && !in_text)) return "stop";
  if (types || ctrlKey || altKey || metaKey) return "none";
  if (isCharacter(key) && !characters) return "none";
  if (key === "?") return "help";
  return /^[1-9]$/.test(key) ? "view" : "own";
}
