// The right edge of the running picture: it moves evenly, though readings come one by one or in bursts.

/** Fraction of the difference between the two clocks that is corrected at each reading. */
const FOLLOWED = 0.1;
/** A larger difference is not jitter: the bus was paused, runs at another speed, or restarted. */
const LEAP_S = 0.5;
/** How far the edge moves on without a reading. */
const ALONE_S = 0.5;

/** The edge in s of bus time, from the bus time of the newest reading and the page's time now, both in s. */
export function edge() {
  let newest = null;
  /** Bus time minus page time. */
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
