"""The journal's database: tables, migrations, statements, failures."""
