// How long it takes from the first byte of the page until a wheel turns, in a browser that has never seen it, on a line of 20 Mbit/s whose round
// trip takes so many ms (none without a number), over HTTP/1.1:
//
//     cargo xtask web -o site
//     SITE=$PWD/site node crates/web/site_tools/first_motion.js 40

import { MODULES, address, begin, end, go, sent, until } from "./browser.js";

const rtt_ms = Number(process.argv[2] ?? 0);
await begin({ mbit_s: 20, rtt_ms });
try {
  await go(address);
  const [first_byte_ms, first_state_ms, first_motion_ms] = await until(
    "the wheel turns",
    `${MODULES}
     const drive = () => link.state?.nodes.find(({ node }) => node === 4)?.drive;
     const soon = () => new Promise((resolve) => setTimeout(resolve, 5));
     const first_byte_ms = performance.getEntriesByType("navigation")[0].responseStart;
     while (!drive()) await soon();
     const first_state_ms = performance.now();
     await ask({ do: "take_control" });
     ask({ do: "velocity", node: 4, rpm: 60 });
     while (!(Math.abs(drive().velocity_rpm) > 1)) await soon();
     return [first_byte_ms, first_state_ms, performance.now()];`,
  );
  const since = (ms) => `${Math.round(ms - first_byte_ms)} ms`;
  console.log(`${sent.length} files, and a round trip of ${rtt_ms} ms; after the first byte: the drives are found after ${since(first_state_ms)}, a wheel turns after ${since(first_motion_ms)}`);
} finally {
  await end();
}
