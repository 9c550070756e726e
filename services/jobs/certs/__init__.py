"""`riposte certs`: who may speak on the bus, as certificates of an authority of the site's own."""
