// The module that computes, on its own thread. Messages: {id, do, ...} to it; {id, answer} and {progress} from it.

interface Module {
  ccall(name: string, result: string, types: string[], values: string[]): string;
  FS: { writeFile(path: string, bytes: Uint8Array | string): void; readFile(path: string): Uint8Array };
}
declare const canyonModule: (options: object) => Promise<Module>;

const post = (message: object, transfer: Transferable[] = []): void => (self as unknown as Worker).postMessage(message, transfer);
let ready: Promise<Module>;

/** A request to canyon_do() (adapters/web/web.cpp), or one of the file system. */
export interface Question {
  id: number;
  do: string;
  path?: string;
  bytes?: Uint8Array | string;
}

async function answer(question: Question): Promise<void> {
  const { id, path = '', bytes = '' } = question;
  if (question.do === 'start') {
    ready = canyonModule({ wasmBinary: bytes, progress: (done: number, planned: number) => post({ progress: done / planned }) });
    await ready;
    return post({ id, answer: {} });
  }
  const module = await ready;
  if (question.do === 'write') module.FS.writeFile(path, bytes);
  else if (question.do === 'read') {
    const file = module.FS.readFile(path).slice();
    return post({ id, answer: { bytes: file } }, [file.buffer]);
  } else return post({ id, answer: JSON.parse(module.ccall('canyon_do', 'string', ['string'], [JSON.stringify(question)])) as object });
  post({ id, answer: {} });
}

// A crashed module reports it instead of being silent.
let turn = Promise.resolve();
self.onmessage = (event: MessageEvent<Question>) => {
  turn = turn.then(() => answer(event.data)).catch((error: unknown) => post({ id: event.data.id, answer: { error: String(error) } }));
};
