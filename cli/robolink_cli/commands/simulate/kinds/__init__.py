"""What each kind of simulator is made and served by, alone or among many."""
