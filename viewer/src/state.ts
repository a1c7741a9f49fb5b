// The user's choices; all drawing code listens to them.

import type { Theme } from './palette';

export type CameraMode = 'free' | 'follow' | 'top' | 'first';
export type Change = 'time' | 'receiver' | 'selection' | 'data' | 'look' | 'camera' | 'playing' | 'map' | 'layers';

export const kLayers = {
  rays: 'rays of received satellites',
  blocked: 'directions of blocked satellites',
  points: 'reflection points and edges',
  dome: 'sky dome and satellites',
  bodies: 'the vehicle, traffic, trees and signs',
  tracks: 'true and estimated track',
  fix: 'fix, error vector, 95 % ellipse',
  others: 'the other receivers',
  ranges: 'pseudorange errors along the street (rms, 1 m high for 1 m)',
} as const;
export type Layer = keyof typeof kLayers;

export class State {
  receiver = 0;
  /** Seconds since the beginning of the run. */
  time = 0;
  /** The receiver's epoch at that time. */
  epoch = 0;
  playing = false;
  speed = 1;
  satellite: number | null = null;
  object: number | null = null;
  /** The selected cell of the heat map. */
  cell: { column: number; row: number } | null = null;
  camera: CameraMode = 'follow';
  colour: 'height' | 'material' = 'height';
  theme: Theme = 'light';
  layers: Record<Layer, boolean> = { rays: true, blocked: false, points: true, dome: true, bodies: true, tracks: true, fix: true, others: true, ranges: true };

  private readonly listeners: ((change: Change) => void)[] = [];

  listen(listener: (change: Change) => void): void {
    this.listeners.push(listener);
  }
  changed(change: Change): void {
    for (const listener of this.listeners) listener(change);
  }
  /** A click on the selected item clears the selection. */
  selectSatellite(satellite: number | null): void {
    this.satellite = satellite === this.satellite ? null : satellite;
    if (this.satellite !== null) this.object = this.cell = null;
    this.changed('selection');
  }
  selectObject(object: number | null): void {
    this.object = object;
    this.cell = null;
    if (object !== null) this.satellite = null;
    this.changed('selection');
  }
  selectCell(cell: { column: number; row: number }): void {
    this.cell = cell;
    this.object = this.satellite = null;
    this.changed('selection');
  }
}
