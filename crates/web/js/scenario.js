// A worker that runs one scenario.

import { runScenario } from "./ferrodrive.js";

addEventListener("message", async ({ data }) => {
  try {
    postMessage({ outcome: await runScenario(data.scenario) });
  } catch (error) {
    postMessage({ error: error.message });
  }
});
