// The views that are not needed for the first picture: fetched after it, so that a page on a slow line is there sooner.

import { consoleView } from "./console.js";
import { driveView } from "./drive.js";
import { faultsView } from "./faults.js";
import { motionView } from "./motion.js";
import { parametersView } from "./parameters.js";
import { pdoView } from "./pdo.js";
import { scopeView } from "./scope.js";
import { traceView } from "./trace.js";
import { worldView } from "./world.js";

/** By name: the view. */
export const laterViews = (shared, report) => ({
  drive: driveView(shared, report),
  motion: motionView(shared, report),
  scope: scopeView(shared, report),
  parameters: parametersView(shared, report),
  pdo: pdoView(shared, report),
  trace: traceView(),
  faults: faultsView(report),
  world: worldView(shared, report),
  console: consoleView(),
});
