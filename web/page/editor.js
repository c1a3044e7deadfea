// The script of `ptm serve DB --edit`, which sites do not have: the tour is edited on the page.

import { attachEditor } from "./edit/editor.js";

attachEditor();
