// @ts-check
/** The page: its parts, joined. */

import { start as startAccess } from "./access.js";
import { start as startAlert } from "./alert.js";
import { start as startAnnouncing } from "./announcing.js";
import { drawIcons } from "./icons.js";
import { loadLanguage } from "./language.js";
import { comeInByOwnLink } from "./own_link.js";
import { Page } from "./page.js";
import { start as startConnection } from "./connection.js";
import { start as startDriving } from "./driving.js";
import { start as startEntering } from "./entering.js";
import { start as startFloor } from "./floor.js";
import { start as startGamepad } from "./gamepad.js";
import { start as startHandover } from "./handover.js";
import { start as startLayout } from "./layout.js";
import { start as startLinks } from "./links.js";
import { start as startPeople } from "./people.js";
import { start as startOverlay } from "./overlay.js";
import { start as startLooking } from "./looking.js";
import { settings, start as startSettings } from "./settings.js";
import { start as startFace } from "./face.js";
import { start as startRobots } from "./robots.js";
import { start as startSound } from "./sound.js";
import { start as startSpeeds } from "./speeds.js";
import { start as startStatus } from "./status.js";
import { start as startTouch } from "./touch.js";
import { start as startWake } from "./wake.js";

await Promise.all([loadLanguage(settings.get("language")), comeInByOwnLink()]);
drawIcons();
const page = new Page();
const PARTS = [
  startLayout,
  startSettings,
  startAccess,
  startAlert,
  startAnnouncing,
  startStatus,
  startOverlay,
  startConnection,
  startRobots,
  startDriving,
  startTouch,
  startGamepad,
  startFloor,
  startLooking,
  startSpeeds,
  startHandover,
  startWake,
  startPeople,
  startLinks,
  startSound,
  startFace,
  startEntering,
];
for (const start of PARTS) start(page);
