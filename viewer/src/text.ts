// Numbers, times and foreign words as the page writes them.

export const kMissing = '–';
export const fixed = (value: number | null | undefined, decimals: number): string =>
  value === null || value === undefined || !Number.isFinite(value) ? kMissing : value.toFixed(decimals);

/** HTML that `html` made. */
class Html {
  constructor(readonly text: string) {}
}
export type { Html };

/** A template of HTML. What stands in it is text, whoever wrote it, but for other such templates and lists of these. */
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

/** Puts it into an element, in the place of what is there. The only way to it. */
export const fill = (host: Element, content: Html): void => void (host.innerHTML = content.text);

/** "08:00:12.5": the time of day, UTC, so many seconds behind the begin (no leap second is counted). */
export function clock(beginUtc: string, seconds: number): string {
  const t = new Date(Date.parse(beginUtc) + Math.round(seconds * 1000));
  return Number.isNaN(t.getTime()) ? kMissing : t.toISOString().slice(11, 21);
}
