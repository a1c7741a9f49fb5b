// Follows running receivers, or a run in computation: shows the newest epoch until the user selects an
// earlier one.

import type { Connection, EpochMessage, HelloMessage, ProgressMessage } from './messages';
import type { State } from './state';
import type { Store } from './store';

/** Stored epochs of each receiver, with their paths: two minutes at 10 Hz. */
export const kKept = 1200;
/** Time without an epoch after which a host is silent [ms]. */
const kSilentMs = 3000;

export class Live {
  following = true;
  private lastMs = -Infinity;
  private fresh = false;
  private drawnMs = 0;
  /** Whether a host has sent its antenna's position. */
  private placed = true;
  private progress: ProgressMessage | null = null;
  private readonly clock: number;
  /** Names of the receivers, without antennas put by the user. */
  private readonly names: string;

  /** @param goTo shows a time; @param redraw redraws parts that show all epochs */
  constructor(private readonly store: Store, private readonly state: State, private readonly connection: Connection,
              private readonly button: HTMLElement,
              private readonly hooks: { goTo: (seconds: number) => void; redraw: () => void }) {
    this.names = store.header.receivers.map((r) => r.name).join('\n');
    button.hidden = false;
    button.onclick = () => this.follow(true);
    this.clock = window.setInterval(() => this.say(), 500);
    this.say();
  }

  /** The run is no longer followed. */
  end(): void {
    clearInterval(this.clock);
    this.button.hidden = true;
  }

  /** The run has ended incomplete. */
  fail(why: () => void): void {
    clearInterval(this.clock);
    this.button.textContent = 'The run failed';
    this.button.title = 'why';
    this.button.classList.add('bad');
    this.button.onclick = why;
    why();
  }

  /** Takes the progress of a run that is being computed. */
  computed(progress: ProgressMessage): void {
    this.progress = progress;
    this.say();
  }

  follow(on: boolean): void {
    this.following = on;
    this.fresh = true;
    this.say();
  }

  /** A different run than the loaded one needs a new page. */
  hello(message: HelloMessage): void {
    const header = this.store.header;
    const same = message.receivers.map((r) => r.name).join('\n') === this.names;
    if (header.time?.begin_utc !== message.begin_utc || !same) location.reload();
  }

  take(message: EpochMessage): void {
    const receiver = this.store.header.receivers.findIndex((r) => r.name === message.receiver);
    if (receiver < 0) return;
    this.placed = message.place.east_m !== null || this.store.tracks[receiver] !== undefined;
    if (!this.placed) return;  // there is no position to draw it
    this.store.append(receiver, message, kKept);
    // Only faults of the newest epoch: their end is unknown in a live run.
    const entry = this.store.header.receivers[receiver];
    if (entry) entry.faults = message.faults.map((name) => ({ name, from_s: message.time_s, until_s: message.time_s }));
    this.lastMs = performance.now();
    this.fresh = true;
  }

  /** Once per picture: shows the newest of all received epochs. */
  frame(now: number): void {
    if (!this.fresh) return;
    this.fresh = false;
    const [, last] = this.store.span;
    if (this.following) this.hooks.goTo(last);
    else this.state.changed('time');
    if (now - this.drawnMs < 1000) return;
    this.drawnMs = now;
    this.hooks.redraw();
  }

  say(): void {
    const { progress } = this;
    const silent = !progress && performance.now() - this.lastMs > kSilentMs;
    const text = !this.connection.open ? 'Connection lost; trying again'
      : progress ? `Computing: ${progress.done} of ${progress.planned} epochs${this.following ? '' : '; go to the newest'}`
      : !this.placed ? 'Live: the host has no pose yet'
      : this.lastMs === -Infinity ? 'Live: waiting for an epoch'
      : silent ? `Live: no epoch for ${((performance.now() - this.lastMs) / 1000).toFixed(0)} s`
      : this.following ? 'Live' : 'Live: go to now';
    if (this.button.textContent !== text) this.button.textContent = text;
    this.button.classList.toggle('bad', !this.connection.open || silent);
    this.button.setAttribute('aria-pressed', String(this.following && this.connection.open && !silent));
  }
}
