// Follows a receiver that runs now: its newest epoch is shown until somebody looks at an earlier one.

import type { Connection, EpochMessage, HelloMessage } from './messages';
import type { State } from './state';
import type { Store } from './store';

/** Epochs that are kept of each receiver, with their paths: two minutes at 10 Hz. */
export const kKept = 1200;
/** Without an epoch for so long a receiver is silent [ms]. */
const kSilentMs = 3000;

export class Live {
  following = true;
  private lastMs = -Infinity;
  private fresh = false;
  private drawnMs = 0;

  /** @param goTo shows a time; @param redraw draws what knows all epochs */
  constructor(private readonly store: Store, private readonly state: State, private readonly connection: Connection,
              private readonly button: HTMLElement,
              private readonly hooks: { goTo: (seconds: number) => void; redraw: () => void }) {
    button.hidden = false;
    button.onclick = () => this.follow(true);
    setInterval(() => this.say(), 500);
    this.say();
  }

  follow(on: boolean): void {
    this.following = on;
    this.fresh = true;
    this.say();
  }

  /** Another run than the page was loaded for is another page. */
  hello(message: HelloMessage): void {
    const header = this.store.header;
    const same = message.receivers.every((r, i) => header.receivers[i]?.name === r.name);
    if (header.time?.begin_utc !== message.begin_utc || !same) location.reload();
  }

  take(message: EpochMessage): void {
    const receiver = this.store.header.receivers.findIndex((r) => r.name === message.receiver);
    if (receiver < 0) return;
    this.store.append(receiver, message, kKept);
    // Faults of the newest epoch alone: a live run does not know when they will end.
    const entry = this.store.header.receivers[receiver];
    if (entry) entry.faults = message.faults.map((name) => ({ name, from_s: message.time_s, until_s: message.time_s }));
    this.lastMs = performance.now();
    this.fresh = true;
  }

  /** Once a picture: however many epochs have come, the newest is shown. */
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
    const silent = performance.now() - this.lastMs > kSilentMs;
    const text = !this.connection.open ? 'Connection lost; trying again'
      : this.lastMs === -Infinity ? 'Live: waiting for an epoch'
      : silent ? `Live: no epoch for ${((performance.now() - this.lastMs) / 1000).toFixed(0)} s`
      : this.following ? 'Live' : 'Live: go to now';
    if (this.button.textContent !== text) this.button.textContent = text;
    this.button.classList.toggle('bad', !this.connection.open || silent);
    this.button.setAttribute('aria-pressed', String(this.following && this.connection.open && !silent));
  }
}
