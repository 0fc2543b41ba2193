"""An exploration in the browser: a page on this machine while it runs, or one file that needs no server."""
