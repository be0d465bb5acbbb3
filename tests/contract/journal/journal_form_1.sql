-- A journal of form 1 as robolink 0.1.0 wrote it: one change that was done, one write left open.
PRAGMA page_size=2048;
PRAGMA journal_mode=WAL;
BEGIN TRANSACTION;
CREATE TABLE entries (
	number INTEGER NOT NULL,
	at TEXT NOT NULL,
	controller TEXT NOT NULL,
	kind TEXT NOT NULL,
	change TEXT NOT NULL,
	operation TEXT NOT NULL,
	tool INTEGER,
	tolerance TEXT NOT NULL,
	verdict TEXT NOT NULL,
	details TEXT NOT NULL,
	proved_tool INTEGER,
	operator TEXT NOT NULL,
	role TEXT NOT NULL,
	os_user TEXT NOT NULL,
	host TEXT NOT NULL,
	nozzle TEXT NOT NULL,
	lot TEXT NOT NULL,
	recipe TEXT NOT NULL,
	recipe_hash TEXT NOT NULL,
	station TEXT NOT NULL,
	version TEXT NOT NULL,
	previous TEXT NOT NULL,
	hash TEXT NOT NULL,
	PRIMARY KEY (number)
);
INSERT INTO "entries" VALUES(1,'2026-11-29T03:26:16.320+00:00','epson+tcp://192.0.2.1:5000','intent','','a1',3,'','','{"request":"TLSet 3, XY(1, 2, 3, 4)","tool":3}',NULL,'4711','','','','N7','','','','','0.1.0','','1872f448d8d54ed0c057e29aabe1fc2a4dffc2e2b75c04496b72d10c1fec45b1');
INSERT INTO "entries" VALUES(2,'2026-11-29T03:26:16.339+00:00','epson+tcp://192.0.2.1:5000','done','c1','',3,'','gleich ä 机','{"value":{"x_mm":1.25}}',3,'4711','','','','N7','','','','','0.1.0','1872f448d8d54ed0c057e29aabe1fc2a4dffc2e2b75c04496b72d10c1fec45b1','0cd3e6411c80093f55b991024cd44a10d4778fffcc44e513560423d17d16d566');
INSERT INTO "entries" VALUES(3,'2026-11-29T03:26:16.345+00:00','epson+tcp://192.0.2.1:5000','intent','','b2',4,'','','{"request":"TLSet 4, XY(1, 2, 3, 4)","tool":4}',NULL,'4711','','','','N7','','','','','0.1.0','0cd3e6411c80093f55b991024cd44a10d4778fffcc44e513560423d17d16d566','768abc76486bb422ac934a559e5f724d9f9867ed7054a6264dbbb98f6bc62f57');
CREATE TABLE head (
	number INTEGER NOT NULL,
	hash TEXT NOT NULL
);
INSERT INTO "head" VALUES(3,'768abc76486bb422ac934a559e5f724d9f9867ed7054a6264dbbb98f6bc62f57');
CREATE TABLE leases (
	controller TEXT NOT NULL,
	epoch BIGINT NOT NULL,
	beat BIGINT NOT NULL,
	beat_ns BIGINT NOT NULL,
	token TEXT NOT NULL,
	holder TEXT NOT NULL,
	boot TEXT NOT NULL,
	taken_at TEXT NOT NULL,
	purpose TEXT NOT NULL,
	PRIMARY KEY (controller)
);
INSERT INTO "leases" VALUES('epson+tcp://192.0.2.1:5000',2,0,39957818462049,'094057556e57a2f36f785b89bd6fadfb','{"boot":"","host":"","operator":"4711","os_user":"","pid":0,"process_start":""}','','2026-11-29T03:26:16+00:00','TLSet 4, XY(1, 2, 3, 4)');
CREATE TABLE markers (
	controller TEXT NOT NULL,
	operation TEXT NOT NULL,
	id BIGINT NOT NULL,
	kind TEXT NOT NULL,
	request TEXT NOT NULL,
	begun_at TEXT NOT NULL,
	details TEXT NOT NULL,
	PRIMARY KEY (controller, operation)
) WITHOUT ROWID;
INSERT INTO "markers" VALUES('epson+tcp://192.0.2.1:5000','b2',1,'set','TLSet 4, XY(1, 2, 3, 4)','2026-11-02T00:00:00+00:00','{"_sum":"86f2dcbde818baf3","tool":4}');
CREATE TABLE schema_version (
	version INTEGER NOT NULL
);
INSERT INTO "schema_version" VALUES(1);
CREATE INDEX entries_by_change ON entries (change, number) WHERE change <> '';
CREATE INDEX entries_by_controller ON entries (controller, number);
CREATE INDEX entries_with_value ON entries (controller, proved_tool, number) WHERE proved_tool IS NOT NULL;
COMMIT;
