// The program under test: CANYON, or the one built by ./run build.
import { spawn, spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

export const root = fileURLToPath(new URL('../..', import.meta.url));
export const program = process.env.CANYON ?? join(root, 'build-release/bin/canyon');
export const withoutProgram = existsSync(program) ? false : `SKIPPED: no ${program} (./run build)`;
process.env.CANYON_VIEWER = join(root, 'viewer/dist/viewer.html');

/** Rows of a CSV file without quoted cells, by the names of its columns. */
export async function csv(file) {
  const [head, ...lines] = (await readFile(file, 'utf8')).trimEnd().split('\n');
  const names = head.split(',');
  return lines.map((line) => Object.fromEntries(line.split(',').map((cell, i) => [names[i], cell])));
}

/** A `canyon` that runs until it is stopped. */
export class Running {
  /** Starts it and waits for its printed address, if it is a server. */
  static async start(args, { serves = true, environment = {} } = {}) {
    const running = new Running();
    running.child = spawn(program, args, { stdio: ['ignore', 'pipe', 'inherit'], env: { ...process.env, ...environment } });
    running.ended = new Promise((resolve) => running.child.once('exit', (code) => resolve(code)));
    if (!serves) return running;
    running.address = await new Promise((resolve, reject) => {
      let text = '';
      running.child.stdout.on('data', (bytes) => {
        text += bytes;
        const found = /^(http:\S+)\n/m.exec(text);
        if (found) resolve(found[1]);
      });
      running.child.once('exit', () => reject(new Error(`canyon ${args.join(' ')} ended`)));
    });
    return running;
  }
  /** Sends Ctrl-C; returns the exit status. */
  async stop(signal = 'SIGINT') {
    this.child.kill(signal);
    return this.ended;
  }
  /** The message of a program that is expected to fail. */
  static refused(args) {
    const result = spawnSync(program, args, { encoding: 'utf8', timeout: 20_000 });
    return result.status === 2 ? result.stderr : '';
  }
}
