// What the browser keeps of a person's choices, as JSON under a name.

/** The kept value; `otherwise` where there is none, or it cannot be read. */
export function kept(name, otherwise) {
  try {
    return JSON.parse(localStorage.getItem(name)) ?? otherwise;
  } catch {
    return otherwise;
  }
}

/** A browser that keeps nothing (a private window, a full disk) works without. */
export function keep(name, value) {
  try {
    localStorage.setItem(name, JSON.stringify(value));
  } catch {
    // Nothing depends on it.
  }
}
