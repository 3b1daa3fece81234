// Which nodes the Bus view lists, in which order, and what is said of all of them. Independent of the page.

export const hasFault = ({ drive }) => Boolean(drive?.fault_code);
export const isSilent = ({ trouble }) => Boolean(trouble);

const text = (value) => value ?? "";
/** By column: what is compared. Values that are not known come last. */
const KEYS = {
  Node: ({ node }) => node,
  Model: ({ title }) => text(title),
  "NMT state": ({ nmt }) => text(nmt),
  "Power state": ({ drive, trouble }) => (trouble ? "no answer" : text(drive?.state)),
  Position: ({ drive }) => drive?.angle_degrees ?? Infinity,
  Speed: ({ drive }) => (drive?.velocity_rpm === undefined || drive.velocity_rpm === null ? Infinity : -Math.abs(drive.velocity_rpm)),
  // Faults and silent nodes first.
  Fault: (node) => (hasFault(node) ? 0 : isSilent(node) ? 1 : 2),
};
export const SORTED = Object.keys(KEYS);

/** The nodes that contain every word of `words`, and with `only` those with a fault or without an answer, ordered by a column. */
export function chosenNodes(nodes, { words = "", only = false, by = "Node", down = false } = {}) {
  const wanted = words.toLowerCase().split(/[\s,]+/).filter(Boolean);
  const has = (node) => {
    const all = [node.node, node.title, node.model, node.nmt, node.drive?.state, node.trouble, ...(node.drive?.faults ?? []).map(({ name }) => name)].map(text).join(" ").toLowerCase();
    return wanted.every((word) => all.includes(word));
  };
  const key = KEYS[by];
  const compared = (one, other) => (key(one) < key(other) ? -1 : key(one) > key(other) ? 1 : 0) * (down ? -1 : 1) || one.node - other.node;
  return nodes.filter((node) => has(node) && (!only || hasFault(node) || isSilent(node))).sort(compared);
}

const count = (many, one) => `${many} ${one}${many === 1 ? "" : "s"}`;

/** What is worth a look, for the header; empty if nothing is. */
export function concerns(nodes) {
  const [faults, silent] = [nodes.filter(hasFault).length, nodes.filter(isSilent).length];
  return [faults ? `${count(faults, "drive")} with a fault` : "", silent ? `${silent} without an answer` : ""].filter(Boolean).join(", ");
}

/** One line about all nodes. */
export function summary(nodes) {
  const drives = nodes.filter(({ drive }) => drive);
  const enabled = drives.filter(({ drive }) => drive.state === "Operation enabled").length;
  return [count(nodes.length, "node"), count(drives.length, "drive"), `${enabled} enabled`, concerns(nodes) || "no faults"].join(" · ");
}
