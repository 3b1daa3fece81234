// How many pictures a second the scope draws while three drives turn, and whether their time passes as fast as the clock, in a browser that has one core for the page, the drives and
// their host:
//
//     cargo xtask web -o site
//     SITE=$PWD/site taskset -c 0 node crates/web/site_tools/pictures.js

import { MODULES, address, begin, end, go, picture, run, until } from "./browser.js";

const NODES = [4, 5, 6];
const SPAN_S = 10;
const machine = NODES.map((node) => `[[drive]]\nmodel = "zlac8030l"\nnode = ${node}\n`).join("");

await begin();
try {
  await go(`${address}#machine=${encodeURIComponent(machine)}`);
  const LINK = `${MODULES}
    const nodes = ${JSON.stringify(NODES)};
    const turn = () => nodes.every((one) => Math.abs((link.state?.nodes.find(({ node }) => node === one)?.drive?.velocity_rpm ?? 0) - 60) < 5);`;
  await until("the drives", `${LINK} return link.fresh && link.state.nodes.length === nodes.length && link.state.nodes.every(({ drive }) => drive)`);
  await run(`${LINK} await ask({ do: "take_control" }); for (const node of nodes) await ask({ do: "velocity", node, rpm: 60 }); location.hash = "scope"; return true`);
  await until("each of them turns", `${LINK} return turn()`);
  await until("all of them are drawn", `for (const one of document.querySelectorAll("[data-beside]")) if (!one.checked) one.click(); return document.querySelectorAll("[data-beside]").length === ${NODES.length - 1}`);
  const { frames, drawn, longest_ms, turning, span_ms, world_ms } = await run(
    `${LINK}
     // Whatever is drawn writes its figures too.
     const { prototype } = CanvasRenderingContext2D;
     const { fillText } = prototype;
     let draws = false;
     prototype.fillText = function (...rest) { draws = true; return fillText.apply(this, rest); };
     const next = () => new Promise(requestAnimationFrame);
     let before = await next(), frames = 0, drawn = 0, longest_ms = 0;
     const began = before;
     const began_s = link.state.time_s;
     while (before - began < ${SPAN_S * 1000}) {
       draws = false;
       const now = await next();
       await Promise.resolve();
       frames += 1;
       drawn += draws ? 1 : 0;
       longest_ms = Math.max(longest_ms, now - before);
       before = now;
     }
     prototype.fillText = fillText;
     return { frames, drawn, longest_ms, turning: turn(), span_ms: before - began, world_ms: (link.state.time_s - began_s) * 1000 };`,
  );
  if (!turning) throw new Error("the drives do not turn any more: the worker was too slow for its own watch over the page");
  await picture("pictures");
  const rate = (count) => (count / (span_ms / 1000)).toFixed(1);
  console.log(`${rate(drawn)} pictures a second, of ${rate(frames)} that the browser asked for; the longest pause ${longest_ms.toFixed(0)} ms`);
  // The state is one of up to 50 ms before.
  console.log(`the drives' time passed ${(world_ms / span_ms).toFixed(3)} times as fast as the clock`);
} finally {
  await end();
}
