// The correlation function of a satellite at a receiver: the sum of the correlation functions of its paths, each with its excess delay,
// strength and phase, as Python's `canyon.correlation()` computes it over time.

import type { Code } from './format';
import type { SatelliteRow } from './store';

/** The function at one instant. Delays are relative to the line of sight [m], magnitudes relative to a clear line of sight. */
export interface CorrelationFunction {
  delays: Float64Array;
  magnitudes: Float64Array;
  /** Magnitude of each single path, at its delay. */
  paths: { kind: number; delay: number; magnitude: number }[];
}

const kSteps = 300;

/** Linear between its values, which extend to one chip. */
function valueOf(code: Code, delay: number): number {
  const at = Math.abs(delay / code.chip_m) * (code.values.length - 1);
  const i = Math.floor(at);
  const low = code.values[i] ?? 0;
  return low + (at - i) * ((code.values[i + 1] ?? 0) - low);
}

/** From one chip before the line of sight to one after the longest delay, at least three chips. */
export function correlationFunction(row: SatelliteRow, code: Code): CorrelationFunction {
  const seen = row.paths.filter((p) => Number.isFinite(p.loss_db));
  const amplitudes = seen.map((p) => 10 ** (-p.loss_db / 20));
  const turns = seen.map((p) => (p.phase_deg * Math.PI) / 180);
  const longest = Math.min(10, Math.max(1, ...seen.map((p) => Math.ceil(p.excess_m / code.chip_m))));
  const delays = Float64Array.from({ length: kSteps + 1 }, (_, i) => ((2 + longest) * (i / kSteps) - 1) * code.chip_m);
  const magnitudes = delays.map((delay) => {
    let re = 0;
    let im = 0;
    seen.forEach((p, k) => {
      const value = (amplitudes[k] ?? 0) * valueOf(code, delay - p.excess_m);
      re += value * Math.cos(turns[k] ?? 0);
      im += value * Math.sin(turns[k] ?? 0);
    });
    return Math.hypot(re, im);
  });
  return { delays, magnitudes, paths: seen.map((p, k) => ({ kind: p.kind, delay: p.excess_m, magnitude: amplitudes[k] ?? 0 })) };
}
