// What the page reports about motion: only what it has seen. Independent of the page.

/** States in which the power stage is on, or may be (CiA 402-2, 8.2). */
const POWERED = ["Operation enabled", "Quick stop active", "Fault reaction active"];
/** A shaft that turns more slowly, and by less in a second, is taken to be at rest. */
const TURNS_RPM = 1;
const TURNS_DEGREES = 1;

/** Whether a drive is seen to turn; `before_degrees` is its shaft position one second before, null if unknown. */
export function isSeenMoving(drive, before_degrees) {
  if (!drive) return false;
  if (Math.abs(drive.velocity_rpm ?? 0) >= TURNS_RPM) return true;
  return before_degrees !== null && drive.angle_degrees !== null && Math.abs(drive.angle_degrees - before_degrees) >= TURNS_DEGREES;
}

/** Whether a node may move without a further command. */
export const mayMove = ({ drive, moving, doing }) => Boolean(moving || doing || (drive && (drive.state === null || POWERED.includes(drive.state))));

/** A text for each drive that was not seen to stop, until the studio sees it at rest. */
export const unseenStops = ({ nodes }) =>
  nodes.filter((node) => node.stop_unseen).map(({ node }) => `NODE ${node} MAY STILL BE MOVING: its stop was not seen. Use the emergency stop`);

/**
 * What is known while the state is stale, as `{ text, urgent }` each: from `state`, the last one received, from whether there is a
 * `connection`, and from the refusal of a studio that does not admit this page; `host` moves the drives. Urgent texts are about drives that
 * nothing stops.
 */
export function lostSight({ state, connected, age_ms, refused = null, host = "the studio" }) {
  const since = `${(Math.floor(age_ms / 100) / 10).toFixed(1)} s`;
  const lost = connected ? `Nothing received from ${host} for ${since}.` : `No connection to ${host}. Trying again …`;
  const lines = [{ text: refused ? `The studio was restarted and does not admit this page: ${refused}.` : lost, urgent: false }];
  if (!state) return lines;
  lines.push({ text: "This page no longer knows what moves; grey values are old.", urgent: false });
  const nodes = state.nodes.filter(mayMove);
  if (!nodes.length) lines.push({ text: "When last seen, no drive had power.", urgent: false });
  for (const { node, goes_on, without_us } of nodes) {
    if (goes_on) lines.push({ text: `Nothing stops node ${node} if ${host} is dead: use the emergency stop.`, urgent: true });
    else if (without_us) lines.push({ text: `Node ${node}: if ${host} is dead, ${without_us}.`, urgent: false });
    else lines.push({ text: `Whether anything stops node ${node} if ${host} is dead is unknown: use the emergency stop.`, urgent: true });
  }
  return lines.sort((one, other) => Number(other.urgent) - Number(one.urgent));
}
