// What a worker says before it can answer.

/** A page takes a worker that says nothing for dead, and a module comes slowly on a slow line. */
const EVERY_MS = 500;

/** Waits for a promise, and says meanwhile that the worker is there. */
export async function whileLoading(coming) {
  const signs = setInterval(() => postMessage({ event: "loading" }), EVERY_MS);
  try {
    return await coming;
  } finally {
    clearInterval(signs);
  }
}
