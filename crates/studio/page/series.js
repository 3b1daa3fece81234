// One value over time: the samples of the last minute, oldest first.

const FIRST_ROOM = 256;

/** Rising times in s, and values. Samples older than `kept_s` before the newest are dropped. */
export class Series {
  constructor(kept_s) {
    this.kept_s = kept_s;
    this.times = new Float64Array(FIRST_ROOM);
    this.values = new Float64Array(FIRST_ROOM);
    this.start = 0;
    this.end = 0;
  }

  get length() {
    return this.end - this.start;
  }

  /** Adds a sample. A repeated time is ignored; a time that goes back starts a new series. */
  push(time_s, value) {
    const newest = this.last_s();
    if (time_s === newest) return;
    if (time_s < newest) this.start = this.end = 0;
    if (this.end === this.times.length) this.makeRoom();
    this.times[this.end] = time_s;
    this.values[this.end] = value;
    this.end += 1;
    while (this.times[this.start] < time_s - this.kept_s) this.start += 1;
  }

  /** Moves the samples to the front, or into twice the room if more than half is in use. */
  makeRoom() {
    const used = this.length;
    const room = used > this.times.length / 2 ? 2 * this.times.length : this.times.length;
    const moved = (from) => {
      const to = room === from.length ? from : new Float64Array(room);
      to.set(from.subarray(this.start, this.end));
      return to;
    };
    this.times = moved(this.times);
    this.values = moved(this.values);
    [this.start, this.end] = [0, used];
  }

  first_s() {
    return this.length ? this.times[this.start] : Infinity;
  }

  last_s() {
    return this.length ? this.times[this.end - 1] : -Infinity;
  }

  /** Index of the first sample at or after a time. */
  at(time_s) {
    let [low, high] = [this.start, this.end];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] < time_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The value at a time: that of the newest sample not later than it; null before the first. */
  value(time_s) {
    let place = this.at(time_s);
    if (place === this.end || this.times[place] > time_s) place -= 1;
    return place < this.start ? null : this.values[place];
  }

  /** The samples between two times as a series, and one sample before them, so that a line reaches the edge. */
  cut(from_s, to_s) {
    const part = new Series(Infinity);
    const from = Math.max(this.at(from_s) - 1, this.start);
    let to = this.at(to_s);
    if (to < this.end) to += 1;
    part.times = this.times.slice(from, to);
    part.values = this.values.slice(from, to);
    part.end = to - from;
    return part;
  }
}
