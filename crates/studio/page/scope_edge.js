// The right edge of the picture while it runs: it moves as evenly as time does, though readings come one by one or in bursts.

/** What of a difference between the two clocks is made good at each reading. */
const FOLLOWED = 0.1;
/** A difference beyond this is no jitter: the bus stood still, runs at another speed, or began anew. */
const LEAP_S = 0.5;
/** How far the edge goes on without a reading. */
const ALONE_S = 0.5;

/** The edge in s of the bus, of when the newest reading was made there and of the page's time now, in s each. */
export function edge() {
  let newest = null;
  /** The bus's time less the page's. */
  let offset_s = 0;
  return (newest_s, now_s) => {
    if (newest_s !== newest) {
      const off_s = newest_s - now_s - offset_s;
      offset_s += newest === null || Math.abs(off_s) > LEAP_S ? off_s : FOLLOWED * off_s;
      newest = newest_s;
    }
    return Math.min(now_s + offset_s, newest_s + ALONE_S);
  };
}
