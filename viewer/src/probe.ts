// An antenna at any point: the running `canyon view` computes it, and the panels show it as a separate receiver.

import type { Connection, EpochMessage, ErrorMessage } from './messages';
import type { Place } from './tracks';
import type { State } from './state';
import type { Store, Track } from './store';
import { by } from './text';

export class Probe {
  /** Index of its receiver in the store, after those of the run. */
  readonly receiver: number;
  /** Milliseconds from the last request to its response. */
  answerMs = NaN;
  private surface: Place | null = null;
  /** The run's receiver for which it was put. */
  base = 0;
  private when = NaN;  // requested epoch, or time [s] without epochs
  private asked = 0;
  private answered = 0;
  private askedAt = 0;
  private again = false;
  private shown = false;  // a response for this antenna

  constructor(private readonly store: Store, private readonly state: State, private readonly connection: Connection | null,
              private readonly hooks: { toast: (text: string) => void; arm: (on: boolean) => void }) {
    this.receiver = store.header.receivers.length;
    by('probe').onsubmit = (e) => e.preventDefault();
    by('probe-height').onchange = () => this.ask();
    by('probe-end').onclick = () => this.end();
  }

  get active(): boolean {
    return this.surface !== null;
  }

  arm(): void {
    if (!this.connection) {
      return this.hooks.toast('This page was exported: to put antennas, show the scenario with a running “canyon view”.');
    }
    by('probe').hidden = false;
    this.hooks.arm(true);
  }

  /** @param height above it [m]; otherwise the value in the box */
  put(surface: Place, height?: number): void {
    if (!this.connection) return this.arm();
    if (height !== undefined) by<HTMLInputElement>('probe-height').value = String(height);
    if (!this.active) [this.base, this.shown] = [this.state.receiver, false];
    this.surface = surface;
    by('probe').hidden = false;
    by('probe-where').textContent = `${surface.map((v) => v.toFixed(1)).join(', ')} (east, north, up)`;
    this.hooks.arm(false);
    this.ask();
  }

  end(): void {
    by('probe').hidden = true;
    by('probe-where').textContent = 'the next click';
    this.hooks.arm(false);
    if (!this.active) return;
    this.surface = null;
    if (this.state.receiver !== this.receiver) return;
    this.state.receiver = this.base;
    this.store.drop(this.receiver);
    this.state.changed('receiver');
  }

  /** Follows the run's time: a new request for each epoch of the receiver. */
  goTo(seconds: number): void {
    const [from, to] = this.track ? this.store.span : [seconds, seconds];
    this.state.time = Math.min(to, Math.max(from, seconds));
    if (this.now !== this.when) this.ask();
    this.state.changed('time');
  }

  /** Track of the run's receiver; null for a heat map in a scenario's city. */
  private get track(): Track | undefined {
    return this.store.tracks[this.base];
  }
  /** The receiver it is like: in a validation the simulated one. */
  private get like(): number {
    return this.store.header.comparison?.simulated ?? this.base;
  }
  private get now(): number {
    return this.track?.epochAt(this.state.time) ?? this.state.time;
  }

  private ask(): void {
    if (!this.surface || !this.connection) return;
    if (this.asked !== this.answered) {  // one request at a time, the newest next
      this.again = true;
      return;
    }
    this.when = this.now;
    const [east_m, north_m, up_m] = this.surface;
    const box = by<HTMLInputElement>('probe-height');
    if (box.value === '' || !box.validity.valid) return this.hooks.toast('Give the antenna’s height in metres, from 0 to 1000.');
    const height = Number(box.value);
    this.askedAt = performance.now();
    const sent = this.connection.send({ type: 'probe', version: 1, id: this.asked + 1, receiver: this.like,
      time_s: this.track?.time[this.when] ?? this.state.time, place: { east_m, north_m, up_m: up_m + height } });
    if (sent) ++this.asked;
    else this.hooks.toast('There is no connection to canyon: is “canyon view” still running?');
  }

  /** True if the message is a response to this page. */
  take(message: EpochMessage | ErrorMessage): boolean {
    if (message.id === undefined) return false;
    this.answered = this.asked;
    this.answerMs = performance.now() - this.askedAt;
    if (message.type === 'error') {
      this.hooks.toast(message.message);
      if (!this.shown) this.end();
    }
    else if (this.active) this.show(message);
    if (this.again) {
      this.again = false;
      this.ask();
    }
    return true;
  }

  /** The connection broke: there will be no response. */
  lost(): void {
    this.answered = this.asked;
  }

  private show(message: EpochMessage): void {
    const { store, state } = this;
    this.shown = true;
    const like = store.header.receivers[this.like];
    if (!like) return;
    store.header.receivers[this.receiver] = { ...like, name: `antenna put as ${like.name}, just switched on`, faults: [],
      summary: null };
    store.append(this.receiver, message, 1);
    state.epoch = 0;
    if (state.receiver === this.receiver) return state.changed('time');
    state.receiver = this.receiver;
    state.changed('receiver');
  }
}
