// From a heat map's values to colours, as in Canyon's own pictures (canyon/analysis/heatmap/pictures/map_style.hpp).

import type { MapLayer } from './format';

/** A layer's colours as selected by the user. */
export interface Scale {
  low: number;
  high: number;
  /** Name of the header's list of colours. */
  colours: string;
}

export type Rgb = [number, number, number];

export function rgb(hex: string): Rgb {
  const n = parseInt(hex.slice(1), 16);
  return [n >> 16, (n >> 8) & 255, n & 255];
}

/** Position on the bar, 0 to 1, of a value in the layer's own unit. */
export function position(layer: MapLayer, scale: Scale, value: number): number {
  const eased = (part: number): number => (layer.progression === 'square root' ? Math.sqrt(part) : part);
  const { low, high } = scale;
  if (low < 0) return 0.5 + 0.5 * Math.sign(value) * eased(Math.min(Math.abs(value) / high, 1));
  if (layer.progression === 'logarithm' && low > 0) {
    return value <= low ? 0 : Math.min(Math.log(value / low) / Math.log(high / low), 1);
  }
  return eased(Math.min(1, Math.max(0, (value - low) / (high - low))));
}

/** The value at a position; inverse of position(). */
export function valueAt(layer: MapLayer, scale: Scale, t: number): number {
  const eased = (part: number): number => (layer.progression === 'square root' ? part * part : part);
  const { low, high } = scale;
  if (low < 0) return Math.sign(t - 0.5) * eased(Math.abs(2 * t - 1)) * high;
  if (layer.progression === 'logarithm' && low > 0) return low * (high / low) ** t;
  return low + eased(t) * (high - low);
}

/** The colour of a position on the bar. */
export function colourAt(layer: MapLayer, bar: readonly Rgb[], t: number): Rgb {
  let at = Math.min(1, Math.max(0, t));
  if (layer.classes === 1) at = 0.5;
  if (layer.classes > 1) at = Math.min(Math.floor(at * layer.classes + 1e-9), layer.classes - 1) / (layer.classes - 1);
  if (layer.large_is_bad) at = 1 - at;
  return bar[Math.round(at * (bar.length - 1))] ?? [0, 0, 0];
}

/** "7.38", "0.95", "1234": three digits of a value; integers if `decimals` is 0. */
export function figure(value: number, decimals: number): string {
  if (decimals === 0) return value.toFixed(Number.isInteger(value) ? 0 : 1);
  const size = Math.abs(value);
  return value.toFixed(size >= 999.5 ? 0 : size >= 99.95 ? 1 : decimals);
}
