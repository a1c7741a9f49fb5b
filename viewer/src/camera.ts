// The camera and its controls: free, follow, top, first person. All use one orbit, given by angles.

import { PerspectiveCamera, Vector3 } from 'three';
import type { CameraMode } from './state';

const kRadians = Math.PI / 180;

export class CameraControl {
  readonly camera = new PerspectiveCamera(50, 1, 0.5, 20_000);
  /** Viewing direction of the camera: azimuth from north clockwise, and angle below the horizontal [deg]. */
  azimuth = 35;
  down = 38;
  distance = 260;
  readonly target = new Vector3();
  private mode: CameraMode = 'follow';
  private readonly vehicle = new Vector3();
  private heading = 0;
  private readonly pointers = new Map<number, { x: number; y: number }>();
  private moved = 0;

  /** @param onMove the picture must be redrawn
   *  @param onPick a click, in the element's normalised coordinates; whether Shift was held */
  constructor(element: HTMLElement, onMove: () => void, onPick: (x: number, y: number, shift: boolean) => void) {
    element.addEventListener('pointerdown', (e) => {
      element.setPointerCapture(e.pointerId);
      this.pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
      this.moved = 0;
    });
    element.addEventListener('pointermove', (e) => {
      const last = this.pointers.get(e.pointerId);
      if (!last) return;
      const dx = e.clientX - last.x;
      const dy = e.clientY - last.y;
      this.moved += Math.abs(dx) + Math.abs(dy);
      if (this.pointers.size === 2) this.pinch(e.pointerId, last, e);
      else if ((e.buttons & 2) !== 0 || e.shiftKey) this.pan(dx, dy, element.clientHeight);
      else this.turn(dx, dy, element.clientHeight);
      last.x = e.clientX;
      last.y = e.clientY;
      onMove();
    });
    const release = (e: PointerEvent): void => {
      if (!this.pointers.delete(e.pointerId)) return;
      if (e.type !== 'pointerup' || this.moved > 4) return;
      const box = element.getBoundingClientRect();
      onPick(((e.clientX - box.left) / box.width) * 2 - 1, 1 - ((e.clientY - box.top) / box.height) * 2, e.shiftKey);
    };
    element.addEventListener('pointerup', release);
    element.addEventListener('pointercancel', release);
    element.addEventListener('contextmenu', (e) => e.preventDefault());
    element.addEventListener('wheel', (e) => {
      e.preventDefault();
      this.zoom(Math.exp(e.deltaY * 0.0012));
      onMove();
    }, { passive: false });
  }

  private pinch(id: number, last: { x: number; y: number }, now: PointerEvent): void {
    for (const [other, p] of this.pointers) {
      if (other === id) continue;
      const before = Math.hypot(last.x - p.x, last.y - p.y);
      const after = Math.hypot(now.clientX - p.x, now.clientY - p.y);
      if (before > 0 && after > 0) this.zoom(before / after);
    }
  }

  turn(dx: number, dy: number, height: number): void {
    if (this.mode === 'top') return this.pan(dx, dy, height);
    const speed = this.mode === 'first' ? -this.camera.fov / height : 180 / height;
    this.azimuth += dx * speed;
    this.down = Math.min(this.mode === 'first' ? 60 : 89, Math.max(this.mode === 'first' ? -89 : 2, this.down + dy * speed));
  }

  pan(dx: number, dy: number, height: number): void {
    if (this.mode === 'first') return;
    const metres = (2 * this.distance * Math.tan((this.camera.fov / 2) * kRadians)) / height;
    const a = this.mode === 'top' ? 0 : this.azimuth * kRadians;
    const stretch = this.mode === 'top' ? 1 : 1 / Math.max(0.3, Math.sin(this.down * kRadians));
    this.target.x += -dx * metres * Math.cos(a) + dy * metres * stretch * Math.sin(a);
    this.target.y += dx * metres * Math.sin(a) + dy * metres * stretch * Math.cos(a);
  }

  zoom(factor: number): void {
    if (this.mode === 'first') this.camera.fov = Math.min(110, Math.max(20, this.camera.fov * factor));
    else this.distance = Math.min(8000, Math.max(8, this.distance * factor));
  }

  setMode(mode: CameraMode): void {
    if (mode === this.mode) return;
    const was = this.mode;
    this.mode = mode;
    this.camera.fov = mode === 'first' ? 75 : 50;
    if (mode === 'first') {
      this.azimuth = this.heading;
      this.down = -18;
    } else if (was === 'first' || (was === 'top' && mode !== 'top')) {
      this.down = 38;
    }
    if (mode === 'follow' || mode === 'top') this.target.copy(this.vehicle);
  }

  /** The antenna's position and its direction of travel (azimuth, degrees). */
  moveVehicle(place: Vector3, heading: number): void {
    if (this.mode === 'follow' || this.mode === 'top') this.target.add(place).sub(this.vehicle);
    if (this.mode === 'first') this.azimuth += heading - this.heading;
    this.vehicle.copy(place);
    this.heading = heading;
  }

  apply(aspect: number): void {
    const c = this.camera;
    const a = this.azimuth * kRadians;
    if (this.mode === 'first') {
      const d = -this.down * kRadians;
      c.position.copy(this.vehicle).setZ(this.vehicle.z + 0.3);
      c.up.set(0, 0, 1);
      c.lookAt(c.position.x + Math.sin(a) * Math.cos(d), c.position.y + Math.cos(a) * Math.cos(d), c.position.z + Math.sin(d));
      c.near = 0.2;
    } else if (this.mode === 'top') {
      c.position.copy(this.target).setZ(this.target.z + this.distance);
      c.up.set(0, 1, 0);
      c.lookAt(this.target);
      c.near = 1;
    } else {
      const d = this.down * kRadians;
      c.position.set(
        this.target.x - Math.sin(a) * Math.cos(d) * this.distance,
        this.target.y - Math.cos(a) * Math.cos(d) * this.distance,
        this.target.z + Math.sin(d) * this.distance,
      );
      c.up.set(0, 0, 1);
      c.lookAt(this.target);
      c.near = Math.max(0.5, this.distance / 200);
    }
    c.aspect = aspect;
    c.far = this.distance + 12_000;
    c.updateProjectionMatrix();
    c.updateMatrixWorld();
  }
}
