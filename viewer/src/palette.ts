// Colours: Okabe and Ito's, the same in all of Canyon's pictures (canyon/outputs/drawing/palette.hpp).

/** By the index of words.visibility: LOS, LOS with multipath, NLOS, blocked. */
export const kVisibilityColours = ['#009E73', '#0072B2', '#E69F00', '#7A7A7A'] as const;
/** On a dark background blue and green are lighter, so that thin lines keep a contrast of 3 to 1. */
const kVisibilityOnDark = ['#1FC298', '#4FB0EC', '#F0B32E', '#9AA0A6'] as const;

export const kFixColour = '#CC79A7';
export const kErrorColour = '#D55E00';

/** By the word of fix_kind, for a receiver with corrections. */
const kKindColours: Readonly<Record<string, string>> = {
  fixed: '#009E73', float: '#E69F00', differential: '#0072B2', single: '#7A7A7A', 'dead reckoning': '#7A7A7A',
  combined: '#8A6A00',
};
export const kindColour = (kind: string): string => kKindColours[kind] ?? kErrorColour;

/** Colours of several receivers; shapes differ too. The first is used for a single receiver's fixes. */
const kReceiverColours = [kFixColour, '#56B4E9', '#8A6A00', '#7B4BB3'] as const;
const kReceiverOnDark = [kFixColour, '#56B4E9', '#F0E442', '#B79BE8'] as const;
export const kShapes = ['disc', 'square', 'diamond', 'triangle'] as const;
export type Shape = (typeof kShapes)[number] | 'cross';
/** By the index of words.visibility, as on the sky plot. */
export const kVisibilityShapes: readonly Shape[] = ['disc', 'square', 'triangle', 'cross'];

export type Theme = 'light' | 'dark';

export function visibilityColour(visibility: number, theme: Theme): string {
  return (theme === 'dark' ? kVisibilityOnDark : kVisibilityColours)[visibility] ?? '#7A7A7A';
}

/** By the index of words.path: direct, reflected, diffracted, diffuse, spoofed. */
export function pathColour(kind: number, theme: Theme): string {
  return [visibilityColour(0, theme), visibilityColour(2, theme), kFixColour, visibilityColour(3, theme)][kind] ?? kErrorColour;
}

export function receiverColour(receiver: number, theme: Theme): string {
  return (theme === 'dark' ? kReceiverOnDark : kReceiverColours)[receiver % kShapes.length] ?? kFixColour;
}
export const receiverShape = (receiver: number): Shape => kShapes[receiver % kShapes.length] ?? 'disc';

/** Colours of the three-dimensional view and the canvases. */
export interface Paint {
  sky: string;
  ground: string;
  lowRoof: string;
  highRoof: string;
  ink: string;
  faint: string;
  rule: string;
  panel: string;
  skyline: string;
  accent: string;
  vehicle: string;
  structure: string;
  /** The true track, and the arrow of the vehicle with the antenna. */
  truth: string;
}

export const kPaint: Record<Theme, Paint> = {
  light: {
    sky: '#E4EBF1', ground: '#EFEBE4', lowRoof: '#EEE8DE', highRoof: '#8FA0B5', ink: '#1D2329', faint: '#5D6670',
    rule: '#D3D8DD', panel: '#FFFFFF', skyline: '#C9CED4', accent: '#005A9C',
    vehicle: '#5B6B8C', structure: '#9A7B4F', truth: '#2A3138',
  },
  dark: {
    sky: '#12181F', ground: '#232A31', lowRoof: '#454E57', highRoof: '#93A5BA', ink: '#E8ECEF', faint: '#9BA6B0',
    rule: '#38424C', panel: '#1A2129', skyline: '#414B55', accent: '#6CB8F0',
    vehicle: '#8FA3CC', structure: '#C4A36F', truth: '#F2F4F6',
  },
};

/** Colours of facades and roofs, by the words of the header. */
export const kMaterialColours: Record<string, string> = {
  unknown: '#BDBDBD', concrete: '#C9C4BA', glass: '#7FB2D6', brick: '#B5705A', metal: '#8D99A6', stone: '#A89F91',
  wood: '#B98B5E', plaster: '#E2D6C3', ground: '#D8D2C6', foliage: '#6E9B62',
};
