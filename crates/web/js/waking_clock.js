// A clock that goes on while the machine sleeps.

/** The wall clock went on by so much more than the steady one: the machine slept. */
const ASLEEP_MS = 500;

/** Both clocks, in ms: `performance.now()` may leave out the time in which the machine slept, and the wall clock may be set. */
export const clocks = () => ({ steady: performance.now(), wall: Date.now() });

/** Never goes back. A wall clock that is set forward counts as a sleep: what moves is stopped then, and needs no more than a new command. */
export class WakingClock {
  #last;
  #slept_ms = 0;

  constructor(now = clocks()) {
    this.#last = now;
  }

  /** In ms, from the zero of the steady clock. */
  read(now = clocks()) {
    const missed = now.wall - this.#last.wall - (now.steady - this.#last.steady);
    if (missed > ASLEEP_MS) this.#slept_ms += missed;
    this.#last = now;
    return now.steady + this.#slept_ms;
  }
}
