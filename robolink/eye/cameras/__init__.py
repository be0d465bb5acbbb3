"""What delivers pictures: a folder, a web address, a stream, a camera on USB."""
