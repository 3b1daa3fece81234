// What a page says of motion: only what it has seen. No knowledge of the page.

/** States in which the power stage is on, or may be (CiA 402-2, 8.2). */
const POWERED = ["Operation enabled", "Quick stop active", "Fault reaction active"];
/** A shaft that turns more slowly, and by less in a second, is taken to rest. */
const TURNS_RPM = 1;
const TURNS_DEGREES = 1;

/** Whether a drive is seen to turn; `before_degrees` is where its shaft was a second before, null if that is not known. */
export function isSeenMoving(drive, before_degrees) {
  if (!drive) return false;
  if (Math.abs(drive.velocity_rpm ?? 0) >= TURNS_RPM) return true;
  return before_degrees !== null && drive.angle_degrees !== null && Math.abs(drive.angle_degrees - before_degrees) >= TURNS_DEGREES;
}

/** Whether a node may move without anybody doing anything further. */
export const mayMove = ({ drive, moving, doing }) => Boolean(moving || doing || (drive && (drive.state === null || POWERED.includes(drive.state))));

/** Of which drives a stop was not seen, as texts; until they are seen to stand, which the studio looks for. */
export const unseenStops = ({ nodes }) =>
  nodes.filter((node) => node.stop_unseen).map(({ node }) => `NODE ${node} MAY STILL BE MOVING: its stop was not seen. Use the emergency stop`);

/**
 * What is known once nothing new is shown, as `{ text, urgent }` each: of `state`, the last picture, and of whether there is a
 * `connection`, and what the studio says where it does not let this page in. What is urgent concerns drives that nothing stops.
 */
export function lostSight({ state, connected, age_ms, refused = null }) {
  const since = `${(Math.floor(age_ms / 100) / 10).toFixed(1)} s`;
  const lost = connected ? `Nothing new of the studio for ${since}.` : "No connection to the studio. Trying again …";
  const lines = [{ text: refused ? `The studio was started anew and does not let this page in: ${refused}.` : lost, urgent: false }];
  if (!state) return lines;
  lines.push({ text: "This page no longer knows what moves, and what is grey is old.", urgent: false });
  const nodes = state.nodes.filter(mayMove);
  if (!nodes.length) lines.push({ text: "When they were last seen no drive had power.", urgent: false });
  for (const { node, goes_on, without_us } of nodes) {
    if (goes_on) lines.push({ text: `Node ${node} has nothing that stops it if the studio is dead: use the emergency stop.`, urgent: true });
    else if (without_us) lines.push({ text: `Node ${node}: if the studio is dead, ${without_us}.`, urgent: false });
    else lines.push({ text: `What stops node ${node} if the studio is dead is not known: use the emergency stop.`, urgent: true });
  }
  return lines.sort((one, other) => other.urgent - one.urgent);
}
