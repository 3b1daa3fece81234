// The vertical scales of panes: each by itself, or as a person has set it. Independent of the page.

/** Zoom of one step. */
export const ZOOM = 1.25;

/** Bounds around values with some margin, never equal. A value that does not change is in the middle of a span that fits its size. */
export function around(low, high) {
  if (low > high) return [-1, 1];
  const room = high > low ? (high - low) * 0.1 : Math.max(Math.abs(high) * 0.1, 1);
  return [low - room, high + room];
}

/** The scales that were set, by pane; a pane without one has that of its values. */
export class Scales {
  constructor(kept = {}) {
    this.set = new Map(Object.entries(kept).filter(([, bounds]) => Array.isArray(bounds) && bounds.every(Number.isFinite) && bounds[1] > bounds[0]));
  }

  /** `[low, high]` of a pane whose values lie in this range. */
  of(pane, low, high) {
    return this.set.get(pane) ?? around(low, high);
  }

  isSet(pane) {
    return this.set.has(pane);
  }

  /** Sets a scale; bounds that are not a range are refused with false. */
  fix(pane, low, high) {
    if (!Number.isFinite(low) || !Number.isFinite(high) || !(high > low)) return false;
    this.set.set(pane, [low, high]);
    return true;
  }

  free(pane) {
    this.set.delete(pane);
  }

  /** Makes the span of `bounds` `times` as large; `at`, from 0 (bottom) to 1 (top), stays where it is. */
  zoom(pane, [low, high], times, at = 0.5) {
    const middle = low + (high - low) * at;
    return this.fix(pane, middle - (middle - low) * times, middle + (high - middle) * times);
  }

  /** Moves by a part of the span. */
  move(pane, [low, high], part) {
    return this.fix(pane, low + (high - low) * part, high + (high - low) * part);
  }

  kept() {
    return Object.fromEntries(this.set);
  }
}
