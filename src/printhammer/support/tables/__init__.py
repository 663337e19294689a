"""Tables of numbers in text files, as people, spreadsheets and instruments write them."""
