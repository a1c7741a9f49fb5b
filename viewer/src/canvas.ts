// A canvas in the screen's resolution, redrawn when it or its data change.

/** Below this size [pixels] nothing is drawn. */
const kLeast = 24;

export class Canvas {
  readonly element: HTMLCanvasElement;
  width = 0;
  height = 0;
  private scale = 0;

  constructor(host: HTMLElement, label: string, private readonly draw: (c: CanvasRenderingContext2D, w: number, h: number) => void) {
    this.element = document.createElement('canvas');
    this.element.setAttribute('role', 'img');
    this.element.setAttribute('aria-label', label);
    host.append(this.element);
    new ResizeObserver(() => this.update()).observe(host);
  }

  update(): void {
    const host = this.element.parentElement;
    if (!host) return;
    const scale = devicePixelRatio || 1;
    const { clientWidth, clientHeight } = host;
    // Setting a canvas's size, even to the same value, allocates new memory.
    if (clientWidth !== this.width || clientHeight !== this.height || scale !== this.scale) {
      [this.width, this.height, this.scale] = [clientWidth, clientHeight, scale];
      this.element.width = Math.max(1, Math.round(this.width * scale));
      this.element.height = Math.max(1, Math.round(this.height * scale));
      this.element.style.width = `${this.width}px`;
      this.element.style.height = `${this.height}px`;
    }
    // Drawn by the processor: for such small pictures this is faster than starting a (real or emulated) graphics processor.
    const c = this.element.getContext('2d', { willReadFrequently: true });
    if (!c || Math.min(this.width, this.height) < kLeast) return;
    c.setTransform(scale, 0, 0, scale, 0, 0);
    c.clearRect(0, 0, this.width, this.height);
    this.draw(c, this.width, this.height);
  }
}

export const kFont = 'system-ui, "Segoe UI", "DejaVu Sans", sans-serif';
