// A worker that runs one scenario.

import { runScenario } from "./ferrodrive.js";

addEventListener("message", async ({ data }) => {
  try {
    postMessage({ outcome: await runScenario(data.scenario, { files: data.files }) });
  } catch (error) {
    postMessage({ error: error.message });
  }
});
