// Numbers, times and foreign words as the page writes them.

export const kMissing = '–';
export const fixed = (value: number | null | undefined, decimals: number): string =>
  value === null || value === undefined || !Number.isFinite(value) ? kMissing : value.toFixed(decimals);

/** Text as HTML has it, in quotation marks as well. */
export const escaped = (text: string): string =>
  text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;').replaceAll('"', '&quot;');

/** "08:00:12.5": the time of day, UTC, so many seconds behind the begin (no leap second is counted). */
export function clock(beginUtc: string, seconds: number): string {
  const t = new Date(Date.parse(beginUtc) + Math.round(seconds * 1000));
  return Number.isNaN(t.getTime()) ? kMissing : t.toISOString().slice(11, 21);
}
