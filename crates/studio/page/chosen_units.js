// The unit in which a person looks at each quantity, by its field: the same in every view, and kept by the browser.

import { keep, kept } from "./settings.js";
import { conversion } from "./unit_table.js";

const KEY = "units";
/** The scope had them for itself before. */
const stored = kept(KEY, null) ?? kept("scope", {}).units;
/** By field: a unit. One that a quantity does not have is its own. */
const chosen = stored && typeof stored === "object" ? stored : {};

export const chosenUnits = () => chosen;

export function chooseUnit(field, unit) {
  chosen[field] = unit;
  keep(KEY, chosen);
}

/** The unit, factor and decimals of a quantity whose own unit is `unit`; `feed_m` is what a turn moves. */
export const shownIn = ({ field, unit, decimals = 3 }, feed_m = null) => conversion(unit, chosen[field], feed_m) ?? { unit, factor: 1, decimals };
