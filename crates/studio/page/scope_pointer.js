// Pointer, touch and keys on the picture of the scope, as what they mean. Independent of the page.
//
// A tap sets the cursor; one finger, or the button, moves the picture; two fingers zoom it, sideways the time and upright the scale; on
// the figures beside a pane one finger moves its scale and a double tap sets it free.

/** A finger that moves less far taps. */
const FAR = 6;
/** Two taps within this time are a double tap. */
const DOUBLE_MS = 350;
/** Fingers less far apart in a direction do not zoom in it. */
const APART = 24;

/**
 * `on` takes: `tap(x, y, other)`; `pan(dx)` in pixels; `slide(y, dy)` and `free(y)` on the figures; `zoom(x, times)` and `scale(y, times)`,
 * where `times` is how much larger the span becomes. `isFigures(x)` is true beside the panes.
 */
export function gestures(on, isFigures) {
  const down = new Map();
  let far = false;
  let tapped_ms = -Infinity;

  const middle = (of) => ([...down.values()].reduce((sum, point) => sum + point[of], 0) / down.size);
  const apart = (of) => {
    const [one, two] = [...down.values()];
    return Math.abs(one[of] - two[of]);
  };

  return {
    down({ id, x, y }) {
      // A third finger has no meaning.
      if (down.size >= 2) return;
      down.set(id, { x, y, first: { x, y } });
      far = down.size > 1;
    },

    move({ id, x, y }) {
      const point = down.get(id);
      if (!point) return;
      const before = down.size === 2 ? [apart("x"), apart("y")] : null;
      const [dx, dy] = [x - point.x, y - point.y];
      const left = point.first;
      if (!far && Math.hypot(x - left.x, y - left.y) <= FAR) return;
      // What was moved before it was far enough counts too.
      far = true;
      [point.x, point.y] = [x, y];
      if (!before) {
        if (isFigures(left.x)) on.slide(left.y, dy);
        else on.pan(dx);
        return;
      }
      const now = [apart("x"), apart("y")];
      if (before[0] > APART && now[0] > APART) on.zoom(middle("x"), before[0] / now[0]);
      if (before[1] > APART && now[1] > APART) on.scale(middle("y"), before[1] / now[1]);
    },

    up({ id, x, y, at_ms, other = false }) {
      if (!down.delete(id) || far) return;
      if (!isFigures(x)) return on.tap(x, y, other);
      if (at_ms - tapped_ms < DOUBLE_MS) on.free(y);
      tapped_ms = at_ms;
    },

    lose({ id }) {
      down.delete(id);
    },
  };
}

/** What a key on the picture does: its name and an amount; null for none. Modifier keys other than Shift are left to the browser. */
export function keyMeaning({ key, shiftKey = false, ctrlKey = false, altKey = false, metaKey = false }) {
  if (ctrlKey || altKey || metaKey) return null;
  const wide = shiftKey ? 10 : 1;
  switch (key) {
    case "ArrowLeft":
      return { does: "cursor", by: -wide };
    case "ArrowRight":
      return { does: "cursor", by: wide };
    case "ArrowUp":
      return shiftKey ? { does: "slide", by: 1 } : { does: "scale", by: -1 };
    case "ArrowDown":
      return shiftKey ? { does: "slide", by: -1 } : { does: "scale", by: 1 };
    case "Home":
      return { does: "pane", by: 0 };
    case "End":
      return { does: "free", by: 0 };
    case "PageUp":
      return { does: "pan", by: -1 };
    case "PageDown":
      return { does: "pan", by: 1 };
    case "Enter":
      return { does: "other", by: 0 };
    case "+":
      return { does: "zoom", by: -1 };
    case "-":
      return { does: "zoom", by: 1 };
    default:
      return null;
  }
}
