// SPDX-License-Identifier: Apache-2.0
// Reports and the educator's page in a real browser: a cohort of 60 trainees with 20 sessions each, every page at the size of a
// phone, of a laptop and of paper, the accessibility check of axe-core, forms, roles, hostile texts.
//   node page.mjs PROGRAM OUT_FOLDER CHROMIUM RUNS
import {strict as assert} from "node:assert";
import {execFileSync, spawn} from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import {createRequire} from "node:module";
import {chromium} from "playwright-core";

const [program, out, browserPath, runsFile] = process.argv.slice(2);
const axeSource = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
fs.rmSync(out, {recursive: true, force: true});
fs.mkdirSync(out, {recursive: true});
const store = path.join(out, "sessions.db");
const run = (args, input) => execFileSync(program, args, {env: {...process.env, CATGUT_STORE: store}, input, encoding: "utf8", stdio: ["pipe", "pipe", "inherit"]});

// A cohort drawn from real runs of scripted surgeons (runs.csv: `catgut study studies/levels.toml --out`). With practice, 1 - exp(-k / 6)
// after k sessions, a session becomes less often a novice's run and more often an expert's. Not a model of people.
const real = {};
const [heading, ...lines] = fs.readFileSync(runsFile, "utf8").trim().split(/\r?\n/).map((line) => line.split(","));
for (const line of lines) {
  const run = Object.fromEntries(heading.map((key, i) => [key, line[i]]));
  ((real[run.scene] ??= {})[run.surgeon.split(":")[1]] ??= []).push(run);
}
function correlation(a, b) {
  const mean = (v) => v.reduce((x, y) => x + y, 0) / v.length, ma = mean(a), mb = mean(b);
  const sum = (f) => a.reduce((t, _, i) => t + f(a[i] - ma, b[i] - mb), 0);
  return sum((x, y) => x * y) / Math.sqrt(sum((x) => x * x) * sum((_, y) => y * y));
}
const practice = (k) => 1 - Math.exp(-k / 6);
function cohort(trainees, each) {
  let seed = 7;
  const uniform = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  const gauss = () => Math.sqrt(-2 * Math.log(uniform() + 1e-12)) * Math.cos(2 * Math.PI * uniform());
  const shown = [["edge_in", "mm", 2, 5], ["spacing", "mm", null, 5], ["gap", "mm", null, 1], ["path", "m", null, null], ["bites", "1", null, null], ["tremor", "mm", null, 0.2], ["hesitations", "1", null, 2]];
  const sessions = [];
  for (let k = 0; k < each; ++k) for (let p = 0; p < trainees; ++p) {
    const task = p % 10 === 9 ? "stay" : "purse_string", w = practice(k);
    const level = uniform() < Math.abs(2 * w - 1) ? (w < 0.5 ? "novice" : "expert") : "intermediate", of = real[task][level];
    const run = of[Math.floor(uniform() * of.length)], score = Number(run.score);
    const times = [...Array(300).keys()];
    sessions.push({catgut_session: 1, uid: `s${p}-${k}`, trainee: `T${String(p + 1).padStart(2, "0")}`, task,
      started: `2026-${String(1 + Math.floor(k / 2)).padStart(2, "0")}-${String(1 + (k % 2) * 14).padStart(2, "0")}T08:${String(p).padStart(2, "0")}:00Z`,
      duration_s: Number(run.time), score, score_max: 100, passed: run.passed === "1", rubric: `${task} 2`, program: "0.1.0",
      metrics: shown.filter(([name]) => run[name]).map(([name, unit, low, high]) => ({name, value: Number(run[name]), unit, low, high})),
      lost: [{item: "spacing", reason: "bites 3 and 4 are 7.1 mm apart", place: "bite 4", points: 5, at_s: 44, critical: false}],
      events: [{at_s: 20, kind: "bite_completed", text: ""}],
      details: {lines: [{length_mm: 126}], bites: [...Array(12).keys()].map((b) => ({wall: 0, time_s: 20 * b, along_mm: [10 * b + 1, 10 * b + 5], edge_mm: [4 + gauss(), 4 + gauss()], spacing_mm: 5})),
        tension: {time_s: times.map((i) => i / 10), peak_n: times.map((i) => Math.max(0, 0.6 + 0.5 * Math.sin(i / 9)))}}});
  }
  return {sessions};
}

const file = path.join(out, "cohort.json");
fs.writeFileSync(file, JSON.stringify(cohort(60, 20)));
run(["store", "add", file]);
// Details of another shape than a report expects.
fs.writeFileSync(path.join(out, "odd.json"), JSON.stringify({...cohort(1, 1).sessions[0], uid: "odd", trainee: "ODD", details: {bites: 5, tension: {time_s: "xyz"}, scores: [{items: [null]}]}}));
run(["store", "add", path.join(out, "odd.json")]);
run(["report", "ODD", "--html", path.join(out, "odd_trainee.html")]);
run(["report", "1201", "--html", path.join(out, "odd.html")]);
const hostile = "<img src=x onerror=\"window.hacked=1\">";
for (let p = 1; p <= 60; ++p) run(["store", "person", `T${String(p).padStart(2, "0")}`, "--cohort", p % 2 ? "autumn 2026" : p === 60 ? hostile : "spring 2026", "--level", `PGY${1 + (p % 3)}`]);
let answers = "respondent,group,Q1,Q2,Q3,Q4,Q5\n";
for (let r = 0; r < 24; ++r) answers += `R${r},${r < 12 ? "novice" : "expert"},${[17, 17, 17, 12, 13].map((n) => (r < n ? 3 + (r % 3) : 1 + (r % 2))).join(",")}\n`;
fs.writeFileSync(path.join(out, "answers.csv"), answers);
run(["survey", "import", "rectal_prolapse", path.join(out, "answers.csv")]);
run(["report", "1141", "--html", path.join(out, "session.html")]);
run(["report", "T01", "--html", path.join(out, "trainee.html")]);
run(["survey", "results", "--html", path.join(out, "survey.html")]);

async function serve(args) {
  const child = spawn(program, ["serve", "--port", "0", ...args], {env: {...process.env, CATGUT_STORE: store}});
  process.on("exit", () => child.kill());  // also when a check fails
  const url = await new Promise((good, bad) => {
    let text = "";
    child.stdout.on("data", (d) => { text += d; const m = text.match(/https?:\/\/\S+\//); if (m) good(m[0]); });
    child.on("exit", (code) => bad(new Error(`catgut serve ended with ${code}`)));
  });
  return {url, stop: () => new Promise((done) => { child.on("exit", done); child.kill("SIGINT"); })};
}

let checks = 0;
const check = (condition, what) => { assert(condition, what); ++checks; };
// Faults of layout and accessibility are collected, so that one run shows all of them.
const faults = [];
const expect = (condition, what) => { if (condition) ++checks; else faults.push(what); };
const browser = await chromium.launch({executablePath: browserPath, args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"]});
const sizes = {phone: {width: 390, height: 844}, laptop: {width: 1366, height: 768}};

// A page that reports faults: errors of scripts, of the content policy, and requests to anywhere else.
async function open(context, address, allowed) {
  const page = await context.newPage();
  page.faults = [];
  page.on("pageerror", (e) => page.faults.push(`error: ${e.message}`));
  page.on("console", (m) => { if (m.type() === "error" && !/status of 40[034]/.test(m.text())) page.faults.push(`console: ${m.text()}`); });
  page.on("request", (r) => { if (!r.url().startsWith(allowed) && !r.url().startsWith("data:")) page.faults.push(`request to ${r.url()}`); });
  await page.goto(address);
  return page;
}
async function accessible(page, name) {
  await page.evaluate(axeSource);
  const result = await page.evaluate(() => axe.run(document, {resultTypes: ["violations"]}));
  const list = result.violations.map((v) => `${v.id} (${v.impact}): ${v.nodes.slice(0, 3).map((n) => n.target.join(" ") + " " + n.failureSummary.split("\n")[1]).join("; ")}`);
  expect(list.length === 0, `${name}: ${list.join("\n")}`);
}
async function look(address, name, allowed = address.replace(/[^/]*$/, ""), ready = "main h2") {
  for (const [size, viewport] of Object.entries(sizes)) {
    const context = await browser.newContext({viewport});
    const page = await open(context, address, allowed);
    await page.waitForSelector(ready);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), `${name}, ${size}: the page is wider than the screen`);
    if (size === "phone") expect(await page.evaluate(() => [...document.querySelectorAll(".scroll")].every((t) => t.scrollWidth <= t.clientWidth + 1)), `${name}: a table's columns are beyond the screen of a phone`);
    expect(await page.evaluate(() => window.hacked === undefined), `${name}: a text was run as a script`);
    await page.screenshot({path: path.join(out, `${name}_${size}.png`), fullPage: true});
    await accessible(page, `${name}, ${size}`);
    expect(page.faults.length === 0, `${name}, ${size}: ${page.faults.join("\n")}`);
    if (size === "laptop") await page.pdf({path: path.join(out, `${name}_print.pdf`), format: "A4", margin: {top: "15mm", bottom: "15mm", left: "15mm", right: "15mm"}});
    await context.close();
  }
}

// Files that need no server.
for (const name of ["session", "trainee", "survey"]) await look(`file://${path.resolve(out)}/${name}.html`, `file_${name}`, "file://");
{
  const page = await open(await browser.newContext(), `file://${path.resolve(out)}/session.html`, "file://");
  check((await page.textContent("h1")).includes("T01"), "the session's report names the trainee");
  check(await page.locator("svg[aria-label^='Map of 12 bites']").count() === 1, "stitch map");
  check(await page.locator("svg[aria-label^='Learning curve']").count() === 1, "learning curve");
  check(await page.locator("svg[aria-label^='CUSUM']").count() === 1, "CUSUM");
  check(await page.locator("svg[aria-label^='Tension']").count() === 1, "tension");
  // By keyboard: the first stop skips to the content; the numbers of a chart open with Enter.
  await page.keyboard.press("Tab");
  check(await page.evaluate(() => document.activeElement.textContent) === "Skip to the content", "first stop of the keyboard");
  await page.locator("summary").first().focus();
  await page.keyboard.press("Enter");
  check(await page.locator("details[open] table").count() > 0, "numbers open by keyboard");
}

{
  const page = await open(await browser.newContext(), `file://${path.resolve(out)}/odd.html`, "file://");
  check((await page.locator("text=unknown form").count()) === 3, "three parts of an odd session are left out, the rest is shown");
  check((await page.locator("section[aria-label='Metrics'] tbody tr").count()) === 6 && page.faults.length === 0, "its metrics are there");
}

// The educator's page, without logins, on this machine.
let server = await serve([]);
await look(server.url, "educator", server.url, "html[data-ready] h2");
await look(server.url + "session/1141", "session", server.url);
await look(server.url + "trainee/T01", "trainee", server.url);
await look(server.url + "survey/rectal_prolapse", "form", server.url);
await look(server.url + "survey/rectal_prolapse/results", "results", server.url);
{
  const context = await browser.newContext({viewport: sizes.laptop});
  const times = [];
  for (let i = 0; i < 5; ++i) {
    const page = await context.newPage(), start = performance.now();
    await page.goto(server.url);
    await page.waitForSelector("html[data-ready]");
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    times.push(performance.now() - start);
    await page.close();
  }
  times.sort((a, b) => a - b);
  console.log(`page of 60 trainees x 20 sessions: ${Math.round(times[2])} ms (median of 5, ${Math.round(times[0])} to ${Math.round(times[4])})`);

  const page = await open(context, server.url, server.url);
  await page.waitForSelector("html[data-ready]");
  const tile = async (name) => (await page.locator("dl.tiles div", {hasText: name}).first().locator("dd").textContent()).trim();
  check(await tile("Trainees") === "55" && await tile("Sessions") === "1081", "purse_string: 54 trainees with 20 sessions, and the odd one");
  await page.selectOption("#cohort", "autumn 2026");
  check(await tile("Trainees") === "30", "filter by cohort");
  await page.selectOption("#task", "");
  await page.selectOption("#cohort", "");
  check(await tile("Sessions") === "1201", "all tasks");
  await page.selectOption("#task", "purse_string");
  await page.fill("#search", "T07");
  check(await tile("Trainees") === "1", "search");
  await page.fill("#search", "");
  // The curve's medians against the data.
  await page.selectOption("#cohort", "autumn 2026");
  const sessions = cohort(60, 20).sessions.filter((s) => s.task === "purse_string" && Number(s.trainee.slice(1)) % 2);
  const first = sessions.filter((s) => s.uid.endsWith("-0")).map((s) => s.score).sort((a, b) => a - b);
  const median = (first[14] + first[15]) / 2;
  const curve = page.locator("section[aria-label='Learning curves']");
  await curve.locator("summary").click();
  const shown = Number(await curve.locator("tbody tr").first().locator("td").nth(1).textContent());
  check(Math.abs(shown - median) < 0.01, `median of the first attempt: ${shown}, expected ${median}`);
  // The curve follows the abilities that were put in: at each attempt between novices and experts as the practice says.
  const middle = (level) => real.purse_string[level].map((r) => Number(r.score)).sort((a, b) => a - b)[real.purse_string[level].length >> 1];
  const medians = [];
  for (const row of await curve.locator("tbody tr").all()) medians.push(Number(await row.locator("td").nth(1).textContent()));
  check(medians.length >= 20, `the curve has ${medians.length} attempts`);
  check(Math.abs(medians[0] - middle("novice")) < 6 && Math.abs(medians[19] - middle("expert")) < 6, `curve from ${medians[0]} to ${medians[19]}, expected ${middle("novice")} to ${middle("expert")}`);
  const rise = correlation(medians.slice(0, 20), medians.slice(0, 20).map((_, k) => practice(k)));
  check(rise > 0.9, `correlation of the curve with the practice: ${rise}`);
  await page.selectOption("#cohort", "");
  // Groups by a metric, which is fetched.
  await page.selectOption("#metric", "path");
  await page.waitForSelector("svg[aria-label^='path']");
  await page.selectOption("#by", "level");
  check(await page.locator("svg[aria-label^='path'] rect").count() === 4, "three levels, and none");
  // Assign a task, see it, remove it.
  await page.fill("#a-cohort", "autumn 2026");
  await page.fill("#a-task", "purse_string");
  await page.fill("#a-goal", "70");
  await page.click("text=Assign >> nth=-1");
  await page.waitForSelector("section[aria-label='Assigned tasks'] table");
  check((await page.textContent("section[aria-label='Assigned tasks'] tbody tr")).includes("of 30"), "progress of the assignment");
  await page.click("button[aria-label^='Remove']");
  await page.waitForSelector("text=No tasks are assigned.");
  // Exports.
  const csv = await (await page.request.get(server.url + "export.csv?task=stay")).text();
  check(csv.trim().split("\r\n").length === 121, "CSV: 120 sessions and a heading");
  const xapi = await (await page.request.get(server.url + "export.xapi?cohort=autumn%202026&task=stay")).json();
  check(Array.isArray(xapi), "xAPI is a list");
  // The survey.
  await page.goto(server.url + "survey/rectal_prolapse");
  await page.fill("[name=respondent]", "R99");
  for (const q of ["Q1", "Q2", "Q3", "Q4", "Q5"]) await page.check(`[name='q.${q}'][value='4']`);
  await page.click("text=Send");
  await page.waitForSelector("text=Your answers are stored.");
  await page.goto(server.url + "survey/rectal_prolapse/results");
  check((await page.textContent("dl.tiles dd")) === "25", "the answer counts");
  // Forms from elsewhere, wrong names of the machine, paths that are too long.
  check((await page.request.post(server.url + "assignment", {form: {cohort: "x", task: "y", runs: "1", token: "wrong"}})).status() === 403, "a form without its token is refused");
  check((await page.request.get(server.url, {headers: {Host: "evil.example"}})).status() === 421, "another host name is refused");
  check((await page.request.get(server.url + "a".repeat(5000))).status() === 414, "a long path is refused");
  check((await page.request.get(server.url + "trainee/..%2f..%2fetc")).status() === 404, "no path leads out");
  check((await page.request.get(server.url + "recording/1")).status() === 404, "no recording");
  check(page.faults.length === 0, page.faults.join("\n"));
  await context.close();
}
await server.stop();

// With logins everybody signs in, and a trainee sees their own sessions only.
run(["store", "person", "E1", "--role", "educator"]);
run(["store", "login", "E1"], "correct horse\n");
run(["store", "login", "T01"], "battery staple\n");
server = await serve([]);
await look(server.url + "login", "login", server.url);
{
  const enter = async (name, password) => {
    const context = await browser.newContext();
    const page = await open(context, server.url, server.url);
    check(page.url().endsWith("/login"), "the page asks to sign in");
    await page.fill("[name=name]", name);
    await page.fill("[name=password]", password);
    await page.click("button[type=submit]");
    return page;
  };
  const wrong = await enter("E1", "wrong password");
  await wrong.waitForSelector("[role=alert]");
  const trainee = await enter("T01", "battery staple");
  await trainee.waitForSelector("text=report of a trainee");
  check(trainee.url().endsWith("/trainee/T01"), "a trainee comes to their own page");
  check((await trainee.request.get(server.url + "trainee/T02")).status() === 404, "not to another's");
  check((await trainee.request.get(server.url + "session/2")).status() === 404, "not to another's session");
  check((await trainee.request.get(server.url + "session/1")).status() === 200, "to the own session");
  check((await trainee.request.get(server.url + "export.csv")).status() === 403, "no export");
  check((await trainee.request.get(server.url + "survey/rectal_prolapse/results")).status() === 403, "no results");
  const educator = await enter("E1", "correct horse");
  await educator.waitForSelector("text=signed in as E1");
  await educator.click("text=Sign out");
  await educator.waitForSelector("[name=password]");
}
await server.stop();
await browser.close();
if (faults.length) {
  console.log(faults.join("\n"));
  process.exit(1);
}
console.log(`${checks} checks passed; screenshots in ${out}`);
