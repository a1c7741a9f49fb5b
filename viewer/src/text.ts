// Formats of numbers, times and external words in the page.

export const kMissing = '–';
export const fixed = (value: number | null | undefined, decimals: number): string =>
  value === null || value === undefined || !Number.isFinite(value) ? kMissing : value.toFixed(decimals);

/** HTML made by `html`. */
class Html {
  constructor(readonly text: string) {}
}
export type { Html };

/** A template of HTML. Values in it are escaped as text, except other templates and lists of templates. */
export function html(parts: TemplateStringsArray, ...values: unknown[]): Html {
  const text = (value: unknown): string => value instanceof Html ? value.text
    : Array.isArray(value) ? value.map(text).join('')
    : String(value).replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;').replaceAll('"', '&quot;');
  return new Html(String.raw({ raw: parts }, ...values.map(text)));
}

/** The page's element with this id. */
export function by<T extends HTMLElement = HTMLElement>(id: string): T {
  const element = document.getElementById(id);
  if (!element) throw new Error(`no element ${id}`);
  return element as T;
}

/** Replaces the content of an element by it. The only function that does so. */
export const fill = (host: Element, content: Html): void => void (host.innerHTML = content.text);

/** "08:00:12.5": the time of day, UTC, this number of seconds after the beginning (no leap second is counted). */
export function clock(beginUtc: string, seconds: number): string {
  const t = new Date(Date.parse(beginUtc) + Math.round(seconds * 1000));
  return Number.isNaN(t.getTime()) ? kMissing : t.toISOString().slice(11, 21);
}
