// Static light: computed once for each surface instead of for each pixel of each picture, which is
// too slow without a graphics processor.

import { Color } from 'three';

const kSun = new Color('#fff4e0').multiplyScalar(2.1 / Math.PI);
const kSky = new Color('#ffffff').multiplyScalar(1.8 / Math.PI);
const kGround = new Color('#b9b0a0').multiplyScalar(0.9 / Math.PI).add(new Color('#ffffff').multiplyScalar(0.9 / Math.PI));
const kSunAt = [-0.6, -0.8, 1.1].map((v) => v / Math.hypot(0.6, 0.8, 1.1)) as [number, number, number];

/** The light on a matt surface with this normal (unit, east north up), a linear factor: sun, sky above and ground below. */
export function light(x: number, y: number, z: number, result: Color): Color {
  result.lerpColors(kGround, kSky, 0.5 + 0.5 * z);
  const sun = Math.max(0, x * kSunAt[0] + y * kSunAt[1] + z * kSunAt[2]);
  result.r += sun * kSun.r;
  result.g += sun * kSun.g;
  result.b += sun * kSun.b;
  return result;
}

/** Colours of triangles' corners in their light; `dark`: the fraction for a surface without light. */
export function lit(positions: ArrayLike<number>, colourOf: (triangle: number) => Color, dark: number): Float32Array {
  const lights = lightOfTriangles(positions);
  const result = new Float32Array(positions.length);
  for (let i = 0; i < result.length; i += 3) {
    const triangle = Math.floor(i / 9);
    colourOf(triangle).toArray().forEach((part, k) => (result[i + k] = part * (dark + (1 - dark) * (lights[3 * triangle + k] ?? 1))));
  }
  return result;
}

/** The light of each triangle, by three numbers; positions are nine of each. */
export function lightOfTriangles(positions: ArrayLike<number>): Float32Array {
  const result = new Float32Array(positions.length / 3);
  const p = (i: number): number => positions[i] ?? 0;
  const colour = new Color();
  for (let i = 0; i < positions.length; i += 9) {
    const ax = p(i + 3) - p(i), ay = p(i + 4) - p(i + 1), az = p(i + 5) - p(i + 2);
    const bx = p(i + 6) - p(i), by = p(i + 7) - p(i + 1), bz = p(i + 8) - p(i + 2);
    const [x, y, z] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
    const length = Math.hypot(x, y, z) || 1;
    light(x / length, y / length, z / length, colour).toArray(result, i / 3);
  }
  return result;
}
