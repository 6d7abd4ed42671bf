// SPDX-License-Identifier: Apache-2.0
// The educator's page with the cohort of studies/cohort.toml, in a real browser: how long it takes to open, and whether its learning
// curve is that of the table and follows the practice.
//   catgut study studies/cohort.toml --jobs 8 --out cohort.csv
//   tools/check_page.sh --cohort cohort.csv
import {strict as assert} from "node:assert";
import {execFileSync, spawn} from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import {chromium} from "playwright-core";

const [program, out, browserPath, studies, table] = process.argv.slice(2);
fs.rmSync(out, {recursive: true, force: true});
fs.mkdirSync(out, {recursive: true});
const env = {...process.env, CATGUT_STORE: path.join(out, "sessions.db")};
const run = (args) => execFileSync(program, args, {env, encoding: "utf8", stdio: ["pipe", "pipe", "inherit"]});

const median = (v) => { const s = [...v].sort((a, b) => a - b), n = s.length; return (s[(n - 1) >> 1] + s[n >> 1]) / 2; };
function correlation(a, b) {
  const mean = (v) => v.reduce((x, y) => x + y, 0) / v.length, ma = mean(a), mb = mean(b);
  const sum = (f) => a.reduce((t, _, i) => t + f(a[i] - ma, b[i] - mb), 0);
  return sum((x, y) => x * y) / Math.sqrt(sum((x) => x * x) * sum((_, y) => y * y));
}

// The table, by session; and the practice of each session, from the plan.
const [heading, ...lines] = fs.readFileSync(table, "utf8").trim().split(/\r?\n/).map((line) => line.split(","));
const rows = lines.map((line) => Object.fromEntries(heading.map((key, i) => [key, line[i]])));
const bySession = [];
for (const r of rows) if (r.score !== "") (bySession[Number(r.setting) - 1] ??= []).push(Number(r.score));
const plan = fs.readFileSync(path.join(studies, "cohort.toml"), "utf8");
const practice = [...plan.matchAll(/^practice = ([0-9.]+)$/gm)].map((m) => Number(m[1]));
const trainees = new Set(rows.map((r) => r.seed)).size;

console.log(run(["store", "import", table, "--mapping", path.join(studies, "cohort_sessions.toml")]).trim());
const child = spawn(program, ["serve", "--port", "0"], {env});
process.on("exit", () => child.kill());
const url = await new Promise((good, bad) => {
  let text = "";
  child.stdout.on("data", (d) => { text += d; const m = text.match(/https?:\/\/\S+\//); if (m) good(m[0]); });
  child.on("exit", (code) => bad(new Error(`catgut serve ended with ${code}`)));
});
const browser = await chromium.launch({executablePath: browserPath, args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"]});
const context = await browser.newContext({viewport: {width: 1366, height: 768}});
const times = [];
for (let i = 0; i < 7; ++i) {
  const page = await context.newPage(), start = performance.now();
  await page.goto(url);
  await page.waitForSelector("html[data-ready]");
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  times.push(performance.now() - start);
  await page.close();
}
times.sort((a, b) => a - b);
console.log(`page of ${trainees} trainees, ${rows.length} sessions: ${Math.round(median(times))} ms (median of 7, ${Math.round(times[0])} to ${Math.round(times[6])})`);

const page = await context.newPage();
await page.goto(url);
await page.waitForSelector("html[data-ready]");
const tile = async (name) => Number((await page.locator("dl.tiles div", {hasText: name}).first().locator("dd").textContent()).trim());
assert.equal(await tile("Trainees"), trainees);
assert.equal(await tile("Sessions"), rows.length);
const curve = page.locator("section[aria-label='Learning curves']");
await curve.locator("summary").click();
const shown = [];
for (const row of await curve.locator("tbody tr").all()) shown.push(Number(await row.locator("td").nth(1).textContent()));
assert.equal(shown.length, bySession.length, "one point per session");
shown.forEach((value, k) => assert(Math.abs(value - median(bySession[k])) < 0.051, `session ${k + 1}: ${value} shown, ${median(bySession[k])} in the table`));
console.log(`medians of the score by session: ${shown.join(" ")}`);
if (shown.length > 2) {
  const rise = correlation(shown, practice.slice(0, shown.length));
  console.log(`correlation with the practice: ${rise.toFixed(3)}`);
  assert(rise > 0.9, "the curve does not follow the practice");
}
await page.screenshot({path: path.join(out, "cohort.png"), fullPage: true});
await browser.close();
child.kill("SIGINT");
