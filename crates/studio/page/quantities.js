// The values that the studio reads from a drive. Independent of the page.

/** Field, label, unit, decimals. A current has no step response. */
export const QUANTITIES = [
  { field: "velocity_rpm", label: "Speed", unit: "r/min", decimals: 1 },
  { field: "angle_degrees", label: "Position", unit: "°", decimals: 1 },
  { field: "current_a", label: "Current", unit: "A", decimals: 2, steps: false },
  { field: "supply_v", label: "Supply", unit: "V", decimals: 1 },
  { field: "position_counts", label: "Counts", unit: "counts", decimals: 0 },
  { field: "statusword", label: "Statusword", unit: "", decimals: 0, steps: false },
];

/** The names that such values have in records and captures, where these are others. */
const RECORDED = { angle_degrees: "position_deg" };
const FIELDS = Object.fromEntries(Object.entries(RECORDED).map(([field, name]) => [name, field]));

/** What a value is called in a record, and which value such a name means. */
export const recordedName = (field) => RECORDED[field] ?? field;
export const fieldOf = (name) => FIELDS[name] ?? name;
