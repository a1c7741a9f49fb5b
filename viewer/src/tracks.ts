// True tracks and fixes of the whole run, and the fence of a validation's errors.

import { Group } from 'three';
import { Segments } from './lines';
import { kErrorColour, kindColour, kPaint, receiverColour } from './palette';
import type { State } from './state';
import type { Store, Track } from './store';

/** East, north, up [m]. */
export type Place = [number, number, number];

const kRadians = Math.PI / 180;
/** Maximum number of pieces of a track. */
const kMostPieces = 6000;
/** Tracks are drawn without points this close to their line [m]. */
const kStraight = 0.1;
/** Larger errors are drawn with this height [m]. */
const kHighestFence = 60;

/** Whether two receivers have the same position at beginning, middle and end. */
export function together(a: Track, b: Track): boolean {
  return [0, 0.5, 1].every((share) => {
    const i = Math.floor(share * (a.size - 1));
    const j = b.epochAt(a.time[i] ?? 0);
    return Math.hypot((a.east[i] ?? 0) - (b.east[j] ?? 0), (a.north[i] ?? 0) - (b.north[j] ?? 0)) < 2;
  });
}

/** A line without the points that are within `tolerance` of the remaining line (Douglas and Peucker, 1973). */
export function simplified(line: Place[], tolerance: number): Place[] {
  const keep = new Uint8Array(line.length).fill(0, 1, -1);
  keep[0] = keep[line.length - 1] = 1;
  const open: [number, number][] = [[0, line.length - 1]];
  for (let range = open.pop(); range; range = open.pop()) {
    const [first, last] = range;
    const [a, b] = [line[first], line[last]];
    if (!a || !b) continue;
    const along = [b[0] - a[0], b[1] - a[1], b[2] - a[2]] as const;
    const squared = along[0] ** 2 + along[1] ** 2 + along[2] ** 2;
    let farthest = -1;
    let most = tolerance;
    for (let i = first + 1; i < last; ++i) {
      const p = line[i] ?? a;
      const d = [p[0] - a[0], p[1] - a[1], p[2] - a[2]] as const;
      const t = squared > 0 ? Math.min(1, Math.max(0, (d[0] * along[0] + d[1] * along[1] + d[2] * along[2]) / squared)) : 0;
      const off = Math.hypot(d[0] - t * along[0], d[1] - t * along[1], d[2] - t * along[2]);
      if (off > most) [farthest, most] = [i, off];
    }
    if (farthest < 0) continue;
    keep[farthest] = 1;
    open.push([first, farthest], [farthest, last]);
  }
  return line.filter((_, i) => keep[i]);
}

export class Tracks {
  readonly group = new Group();
  private readonly truth = new Segments(3, 0.9, 0.3);
  private readonly fixes = new Segments(2, 0.9, 0.35);
  private readonly fence = new Segments(2, 0.8, 0.25);

  constructor(private readonly store: Store, private readonly state: State) {
    for (const lines of this.all) this.group.add(lines.group);
  }

  private get all(): Segments[] {
    return [this.truth, this.fixes, this.fence];
  }

  /** For the present state. */
  draw(): void {
    for (const lines of this.all) lines.clear();
    const { tracks } = this.store;
    const own = tracks[this.state.receiver];
    tracks.forEach((track, receiver) => {
      const chosen = receiver === this.state.receiver;
      if (!chosen && !this.state.layers.others) return;
      // Receivers of one vehicle share a true track: draws that of the selected one, with its losses of fix.
      this.drawTrack(track, receiver, chosen || !own || !together(track, own));
    });
    if (this.state.layers.ranges) this.drawFence();
    for (const lines of this.all) lines.finish();
  }

  private drawTrack(track: Track, receiver: number, withTruth: boolean): void {
    const { theme } = this.state;
    const ink = kPaint[theme].truth;
    const fixEast = track.epochs.column('fix_east_m');
    const fixNorth = track.epochs.column('fix_north_m');
    // A long run is drawn without some of its epochs: more pieces are not visible, and would dominate the drawing time.
    const step = Math.max(0.3, track.length / kMostPieces);
    /** Lines of epochs with a position and one colour; they join at changes of colour. */
    const pieces = (lines: Segments, at: (i: number) => Place | null, colourOf: (i: number) => string): void => {
      let line: Place[] = [];
      let before: Place | null = null;
      for (let i = 0; i < track.size; ++i) {
        const here = at(i);
        const last = line.at(-1);
        const ends = !here || i + 1 === track.size || colourOf(i) !== colourOf(i + 1);
        if (here && (ends || !last || Math.hypot(here[0] - last[0], here[1] - last[1]) >= step)) line.push(here);
        else if (!here && before && before !== last) line.push(before);
        if (ends) {
          const points = simplified(line, kStraight);
          points.slice(1).forEach((p, k) => lines.add(points[k] ?? p, p, colourOf(i)));
          line = here ? [here] : [];
        }
        before = here;
      }
    };
    if (withTruth) {
      const corrected = this.store.corrected(receiver);
      pieces(this.truth, (i) => [track.east[i] ?? 0, track.north[i] ?? 0, (track.up[i] ?? 0) - 1],
        (i) => (!track.fixed(i) ? kErrorColour : corrected ? kindColour(this.store.kind(receiver, i)) : ink));
    }
    // On the ground: heights of fixes scatter more than the width of a street, and would hide their horizontal positions.
    const colour = receiverColour(receiver, theme);
    pieces(this.fixes, (i) => (track.fixed(i) ? [fixEast[i] ?? 0, fixNorth[i] ?? 0, (track.up[i] ?? 0) - 0.5] : null), () => colour);
  }

  /** A validation's rms of recorded and simulated pseudorange errors, side by side, 1 m high per metre. */
  private drawFence(): void {
    const { comparison, header } = this.store;
    const pair = header.comparison;
    const track = this.store.tracks[pair?.recorded ?? 0];
    if (!comparison || !pair || !track) return;
    let last = -1;
    for (let i = 0; i < track.size; ++i) {
      const [x, y, z] = [track.east[i] ?? 0, track.north[i] ?? 0, track.up[i] ?? 0];
      if (last >= 0 && Math.hypot(x - (track.east[last] ?? 0), y - (track.north[last] ?? 0)) < 4) continue;
      last = i;
      const yaw = track.epochs.at('yaw_deg', i) * kRadians;
      const pairs = [['recorded_rms_m', pair.recorded, 0], ['simulated_rms_m', pair.simulated, 1.6]] as const;
      for (const [column, receiver, along] of pairs) {
        const high = Math.min(kHighestFence, comparison.at(column, i));
        if (!Number.isFinite(high)) continue;
        const [east, north] = [x + along * Math.cos(yaw), y + along * Math.sin(yaw)];
        this.fence.add([east, north, z], [east, north, z + high], receiverColour(receiver, this.state.theme));
      }
    }
  }
}
