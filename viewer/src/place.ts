// A point of the scene.

/** East, north, up [m]. */
export type Place = [number, number, number];
