// The cursor that Scope and Trace share: a time of the bus, set in the one and shown in the other.

export const linked = {
  /** In s; null before one was set. */
  at_s: null,
  /** Counts the changes. */
  changes: 0,
};

export function linkTo(at_s) {
  if (linked.at_s === at_s) return;
  linked.at_s = at_s;
  linked.changes += 1;
}
