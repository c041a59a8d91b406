// @ts-check
/** A robot was away when somebody opened its page: wait, and open it. */

import { answers, translate } from "./words.js";

const PERIOD = 2000; // ms between two looks

translate();
const robot = `/${location.pathname.split("/")[1]}/`;
setInterval(async () => { if (!document.hidden && await answers(robot, PERIOD)) location.reload(); }, PERIOD);
